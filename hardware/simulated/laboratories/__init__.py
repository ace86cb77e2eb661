"""Laboratories to simulate: the paper's, its ranging set-up, and lasers tuned by their current."""
