"""Speed against what a user would pick instead; see `__main__`."""
