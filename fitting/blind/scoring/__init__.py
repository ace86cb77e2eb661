"""Scores of predictions against the revealed answers, with intervals."""
