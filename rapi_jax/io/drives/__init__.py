"""Drives in files: CSV, generator codes, limits."""
