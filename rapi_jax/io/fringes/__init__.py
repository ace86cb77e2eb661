"""Fringe records in files: a folder with a manifest and one array a record."""
