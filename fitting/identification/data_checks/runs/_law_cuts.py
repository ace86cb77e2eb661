"""Runs on either side of an amplitude, rate or instant: a law of the device may tell them apart."""

import numpy as np

from rapi_jax import Recording


def amplitude_cuts(recording: Recording) -> list[set[int]]:
    """The runs below each amplitude, and above: what differs there may be a law of the device."""
    swings = np.array([drive.u_pp for drive in recording.drives])
    cuts = []
    for level in recording.amplitudes[1:]:
        small = swings < level / 1.01
        cuts += [set(np.flatnonzero(side).tolist()) for side in (small, ~small)]
    return cuts


def rate_cuts(recording: Recording) -> list[set[int]]:
    """The runs below each rate, and above: what differs there may be a law of the device, too."""
    rates = np.array([drive.rate for drive in recording.drives])
    cuts = []
    for level in sorted(recording.rates)[1:]:
        slow = rates < level / 1.01
        cuts += [set(np.flatnonzero(side).tolist()) for side in (slow, ~slow)]
    return cuts


def time_cuts(recording: Recording) -> list[set[int]]:
    """The runs that begin before each instant, and after: there a device that drifts differs."""
    begin = np.array([drive.start_s for drive in recording.drives])
    cuts = []
    for instant in np.unique(begin)[1:]:
        early = begin < instant
        cuts += [set(np.flatnonzero(side).tolist()) for side in (early, ~early)]
    return cuts
