"""A long record cut into runs of one rate and swing."""
