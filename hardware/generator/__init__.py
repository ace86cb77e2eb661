"""The arbitrary function generator: Tektronix AFG31052."""
