"""Noise, measured from repeated periods."""
