"""Refits of hypotheses: on the base, on a density of plays, and on a flexible operator."""
