"""Figures of the diagnosis page."""
