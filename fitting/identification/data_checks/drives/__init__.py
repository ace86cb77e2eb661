"""Drives as they were read: noise that the device does not follow, and columns exchanged."""
