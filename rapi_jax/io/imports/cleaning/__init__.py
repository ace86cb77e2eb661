"""Drives without the noise of their reading: an average over periods, or the waveform fitted."""
