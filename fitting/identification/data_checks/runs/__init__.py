"""Runs that do not belong to the others: changed, exchanged, or read backwards."""
