"""Recordings in files: exchange folder, netCDF-4, oscilloscope CSV."""
