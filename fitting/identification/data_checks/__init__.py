"""Faults of a recording: clipped or resting readings, a wrong period, mode hops."""
