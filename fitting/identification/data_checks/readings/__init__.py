"""Faults of readings: at rest while the drive moves, of few levels, turning back in mid-branch."""
