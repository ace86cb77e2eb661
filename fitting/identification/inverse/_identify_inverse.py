"""The paper's inverse identified: frequency and drive swapped, the rest as for a forward model."""

import dataclasses
from typing import Any

import numpy as np

from fitting.identification._fit import Progress, fit
from fitting.identification._result import FitResult, UntrustedFit
from rapi_jax import ECDL, AbstractOperator, InverseRAPI, Recording, predict
from rapi_jax._waveform import triangle
from rapi_jax.inversion._identified import Identified

from ._swap import swap as swap

_STARTS, _STEPS = 2, 400  # its valleys are longer and more curved than the forward model's
_ORDER, _ORDER_ONE_LOOP = 4, 2
# The last third of one averaged period is most of its falling branch, on which alone each play's
# `lam` shows: leaving it out says nothing. Amplitudes follow from the rates here.
_HOLD_OUT = ("rate",)
_MODEL_SAMPLES = 800


def identify_inverse(
    recording: Recording,
    forward: FitResult,
    *,
    plays: int | None = None,
    order: int | None = None,
    each: tuple[str, ...] | None = None,
    throw: bool = True,
    progress: Progress | None = None,
    **options: Any,
) -> FitResult:
    """Identify the paper's inverse of a device, from a recording and the forward fit to it.

    **Arguments:**

    - `plays`: N1; by default the forward model's.
    - `order`: N2; 4 by default. `each`: what has a value for each play, "lam", "eta" or both; "lam"
      by default. With one rate and amplitude 2 and nothing: one loop cannot tell polynomial
      and asymmetry from plays, and a larger model fits it by what fails on other loops.
    - `options`: those of `fit`; held out are the rates.

    **Returns** a `FitResult` on the swapped recording (`swap`): its errors are in volts, and its
    model takes frequencies as `forward` gives them: `predict(result.ecdl, target)` with the target
    scan as the drive is the drive to send (Eq. 24).
    """
    return fit_inverse(
        swap(recording, forward),
        forward.ecdl.operator,
        plays=plays,
        order=order,
        each=each,
        throw=throw,
        progress=progress,
        **options,
    )


def fit_inverse(
    swapped: Recording,
    forward: AbstractOperator,
    *,
    plays: int | None = None,
    order: int | None = None,
    each: tuple[str, ...] | None = None,
    throw: bool = True,
    progress: Progress | None = None,
    **options: Any,
) -> FitResult:
    """The same on a recording that is already swapped; `forward` gives the first guess."""
    one_loop = len(swapped.rates) == 1 and len(swapped.amplitudes) == 1
    order = (_ORDER_ONE_LOOP if one_loop else _ORDER) if order is None else order
    each = (() if one_loop else ("lam",)) if each is None else each
    first, *others = InverseRAPI.guesses(forward, swapped, plays=plays, order=order, each=each)
    usual = {"guess": [ECDL(guess) for guess in others], "drift": False, "hold_out": _HOLD_OUT}
    options = usual | {"starts": _STARTS, "max_steps": _STEPS} | options
    result = fit(ECDL(first), swapped, throw=False, progress=progress, **options)
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result


def swapped_model(
    ecdl: ECDL, identified: Identified, response_unit: str, drive_unit: str
) -> Recording:
    """A swapped recording from a forward model alone: triangles over the range it was fitted in.

    For an inverse where only the model is at hand; without noise, and without what it lacks.
    """
    rates = identified.rates_hz or (1.0,)
    span = identified.drive_max - identified.drive_min
    drives = triangle(rates, amplitude=span, bias=identified.centre, samples=_MODEL_SAMPLES)
    made = [np.asarray(predict(ecdl, drive)) for drive in drives]
    inputs = [dataclasses.replace(drive, value=y) for drive, y in zip(drives, made, strict=True)]
    sent = [drive.value for drive in drives]
    return Recording.of(inputs, sent, response_unit=drive_unit, drive_unit=response_unit)
