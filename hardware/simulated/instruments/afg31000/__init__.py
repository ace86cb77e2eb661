"""The simulated Tektronix AFG31052, from commands to volts at its load."""
