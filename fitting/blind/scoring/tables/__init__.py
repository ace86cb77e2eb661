"""Scores as tables: rows against their targets, failures, Markdown."""
