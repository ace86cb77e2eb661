"""`rapi bench`: its commands."""
