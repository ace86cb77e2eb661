"""Benches of instruments: their file, their limits, their measurements."""
