"""`rapi population`: its command."""
