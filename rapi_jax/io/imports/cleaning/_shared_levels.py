"""Levels that several runs share: one generator setting, read in each of them."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive

from ._waveform_fit import FittedWaveform


def share_levels(
    drives: Sequence[Drive], found: Sequence[FittedWaveform | None]
) -> list[FittedWaveform | None]:
    """The waveforms with amplitude and offset averaged over the runs that agree in both.

    What differs from run to run is taken for an effect of the rate by a fit; what runs share is
    not. Runs agree where they do within their errors, those of white noise of the size of what
    each waveform leaves.
    """
    shared = list(found)
    groups: list[list[int]] = []
    errors = [_errors(*pair) for pair in zip(drives, found, strict=True)]
    for place, one in enumerate(found):
        if one is None:
            continue
        near = (g for g in groups if all(_agree(found, errors, place, other) for other in g))
        group = next(near, None)
        if group is None:
            groups.append([place])
        else:
            group.append(place)
    for group in groups:
        members = [one for place in group if (one := found[place]) is not None]
        weight = np.array([1.0 / max(errors[place][0], 1e-300) ** 2 for place in group])
        levels = np.average([(m.amplitude, m.offset) for m in members], axis=0, weights=weight)
        for place, one in zip(group, members, strict=True):
            shared[place] = dataclasses.replace(
                one, amplitude=float(levels[0]), offset=float(levels[1])
            )
    return shared


def _errors(drive: Drive, one: FittedWaveform | None) -> tuple[float, float]:
    """Standard errors of amplitude and offset."""
    if one is None:
        return 0.0, 0.0
    whole = drive.period >= 0
    left = float(np.std((drive.value - one(drive.time))[whole])) + 1e-12 * drive.u_pp
    shape = 3.0 if one.waveform == "triangle" else 2.0  # one over the mean square of the shape
    count = float(whole.sum())
    return 2.0 * left * float(np.sqrt(shape / count)), left / float(np.sqrt(count))


def _agree(
    found: Sequence[FittedWaveform | None],
    errors: Sequence[tuple[float, float]],
    place: int,
    other: int,
) -> bool:
    one, two = found[place], found[other]
    if one is None or two is None or one.waveform != two.waveform:
        return False
    most = THRESHOLDS.waveform_sigmas * np.hypot(errors[place], errors[other])
    apart = abs(one.amplitude - two.amplitude), abs(one.offset - two.offset)
    return bool(apart[0] <= most[0] and apart[1] <= most[1])
