"""Oscilloscope records of an interferometer's fringes, read as optical frequency."""
