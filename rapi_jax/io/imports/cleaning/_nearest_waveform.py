"""Which of a triangle and a sine a drive is, where nothing but its samples tells."""

import dataclasses

import numpy as np

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive, Waveform

from ._waveform_fit import fit_waveform


def waveform_misses(drive: Drive) -> dict[Waveform, float]:
    """How far a drive departs from the nearest triangle and sine: rms, as shares of its swing.

    Over its whole periods; the nearer one is first. Empty for a drive that rests or has none.
    """
    misses: dict[Waveform, float] = {}
    kinds: tuple[Waveform, ...] = ("triangle", "sine")
    for kind in kinds if drive.u_pp > 0 else ():
        named = dataclasses.replace(drive, waveform=kind)
        found = fit_waveform(named)
        if found is not None:
            left = (drive.value - found(drive.time))[named.period >= 0]
            misses[kind] = float(np.sqrt(np.mean(left**2))) / drive.u_pp
    return dict(sorted(misses.items(), key=lambda item: item[1]))


def choose_waveform(drive: Drive) -> tuple[Waveform, str]:
    """The waveform of a drive that is said to repeat, and what was found, in words.

    "other" where it is neither a triangle nor a sine.
    """
    misses = waveform_misses(drive)
    said = " and from a ".join(f"{kind} by {100 * miss:.2g} %" for kind, miss in misses.items())
    said = f"it departs from a {said} of its swing rms" if misses else "it has no whole period"
    for kind, miss in misses.items():
        if miss < THRESHOLDS.shape:
            return kind, f"its waveform is taken for a {kind} ({said})"
    return "other", f"its waveform is neither a triangle nor a sine ({said}): give --waveform"
