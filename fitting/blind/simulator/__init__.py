"""Simulated lasers that share no code with the model: actuator, light path, noise, effects."""
