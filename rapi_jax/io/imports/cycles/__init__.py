"""Where the cycles of a drive begin, also of a noisy one; their rates and waveforms."""
