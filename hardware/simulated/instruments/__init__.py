"""Simulated instruments: generator, oscilloscope, laser controller, and their faults."""
