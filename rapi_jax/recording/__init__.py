"""Recordings: drives, the runs that answer them, and the session that they are from."""
