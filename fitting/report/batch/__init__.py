"""A batch for people: one page."""
