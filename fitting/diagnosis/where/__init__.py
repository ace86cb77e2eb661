"""Where the gap lies: its parts, by run, phase, frequency and harmonic."""
