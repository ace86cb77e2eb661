"""Fits from sums over the intervals between contacts of plays, instead of from samples."""
