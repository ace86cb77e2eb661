"""Drives as samples: periods and turning points, the sampling grid of a run, runs as one batch."""
