"""Which law the thresholds of the hysteresis follow, chosen before any effect is blamed."""
