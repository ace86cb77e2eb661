"""Lasers that are tuned by their current: heat, carriers, power, and two devices."""
