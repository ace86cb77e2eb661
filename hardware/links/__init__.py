"""How instruments are reached: bounded sessions over VISA."""
