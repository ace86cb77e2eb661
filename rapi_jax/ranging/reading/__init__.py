"""From raw photodiode records to scans: both phases, turns, and the peaks of the cavity."""
