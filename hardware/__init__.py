"""Instruments, and what stands in for them: the only package that talks to a laboratory."""
