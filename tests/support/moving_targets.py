"""Scans of simulated targets, from closed forms in NumPy: nothing of ours but the record."""

import numpy as np

GAIN = 256.0  # s: 6400 widths of a scan at 780 nm and 60 GHz, of 0.04 s each
RATE = 20.0  # scans a second, up and down in turn
ERROR = 1e-5  # m


def middles(scans: int) -> tuple[np.ndarray, np.ndarray]:
    """Times of the scans' middles and their Doppler gains."""
    number = np.arange(scans)
    return (number + 0.5) / RATE, GAIN * np.where(number % 2 == 0, 1.0, -1.0)


def constant(time, velocity, *, first=0.7):
    """Distance and velocity of a target at constant velocity."""
    return first + velocity * time, np.full(time.size, velocity)


def stage(time, velocity, *, begin, end, first=0.7, acceleration=0.2):
    """A stage that starts at `begin` and stops at `end`, with ramps."""
    ramp = abs(velocity) / acceleration
    fine = np.linspace(0.0, time[-1] + 1.0, 20_001)
    speed = velocity * np.interp(fine, [begin, begin + ramp, end, end + ramp], [0.0, 1.0, 1.0, 0.0])
    steps = (speed[1:] + speed[:-1]) / 2 * np.diff(fine)
    distance = first + np.concatenate([[0.0], np.cumsum(steps)])
    return np.interp(time, fine, distance), np.interp(time, fine, speed)


def vibrating(time, rng, *, rms=1.5e-5, first=0.7):
    """A target at rest that shakes: sines of random size and phase, `rms` in m/s."""
    distance, velocity = np.full(time.size, first), np.zeros(time.size)
    lines = np.array([3.1, 7.3, 17.7, 31.0])
    for hertz in lines:
        size = rms * rng.rayleigh() / np.sqrt(2.0 * lines.size)
        phase = rng.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * hertz * time
        distance += size / (2.0 * np.pi * hertz) * np.sin(phase)
        velocity += size * np.cos(phase)
    return distance, velocity


def apparent(rng, gain, distance, velocity, *, error=ERROR):
    """What the scans read: the size of L + G v with noise."""
    return np.abs(distance + gain * velocity + error * rng.standard_normal(distance.size))
