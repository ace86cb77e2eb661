"""Drives of a triangle, and how well its turning points are known."""

import numpy as np

from rapi_jax import Drive

# Turning points are first found in bins of a period, 200 of them where there are samples enough,
# and then between samples; where noise or a plateau forbids that, phases are right to a bin.
BIN = 1.0 / 200


def triangle_at(cycles, minimum=0.0):
    """A triangle of 1 to 5 V with its minimum at phase `minimum`."""
    return 3.0 + 2.0 * (1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles - minimum, 1.0)))


def periodic(samples, per_period, minimum=0.0, hz=10.0, noise=0.0):
    cycles = np.arange(samples) / per_period
    value = triangle_at(cycles, minimum) + noise * np.random.default_rng(1).normal(size=samples)
    return Drive(cycles / hz, value, hz, "triangle")
