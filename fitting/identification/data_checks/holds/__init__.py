"""Single sweeps, and what moves while the drive rests: creep, or the settling of a mount."""
