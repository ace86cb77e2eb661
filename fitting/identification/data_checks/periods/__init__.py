"""Periods of a run beside one another: which are alike, and a first one that is not."""
