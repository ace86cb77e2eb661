"""Identification of the paper's inverse (Eq. 24): a fit with frequency and drive swapped."""

import dataclasses

import numpy as np

from fitting.identification._fit import fit
from fitting.identification._options import Progress
from fitting.identification._result import FitResult, UntrustedFit
from fitting.identification._thresholds import THRESHOLDS
from rapi_jax import ECDL, AbstractOperator, Identified, InverseRAPI, Recording, predict, triangle
from rapi_jax.internal import takes

from ._swap import swap as swap

# The last third of one averaged period is most of its falling branch, on which alone each play's
# `lam` shows: leaving it out says nothing. Amplitudes follow from the rates here.
HOLD_OUT = ("rate",)


@takes(recording=Recording, forward=FitResult)
def identify_inverse(
    recording: Recording,
    forward: FitResult,
    *,
    plays: int | None = None,
    order: int | None = None,
    each: tuple[str, ...] | None = None,
    starts: int = 2,
    hold_out: bool | tuple[str, ...] = HOLD_OUT,
    max_steps: int = 400,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Identify the paper's inverse of a device, from a recording and the forward fit to it.

    **Arguments:**

    - `plays`: N1; by default the forward model's.
    - `order`: N2; 4 by default. `each`: what has a value for each play, "lam", "eta" or both; "lam"
      by default. With a single rate and amplitude the defaults are order 2 and no `each`: one
      loop cannot tell polynomial and asymmetry from plays, and a larger model fits it by what fails
      on other loops.
    - `hold_out`: by default the rates.
    - `starts`, `max_steps`, `throw`, `progress`: as for `fit`.

    **Returns** a `FitResult` on the swapped recording (`swap`): its errors are in volts, and its
    model takes frequencies as `forward` gives them: `predict(result.ecdl, target)` with the target
    scan as the drive is the drive to send (Eq. 24).

    >>> from fitting import fit, identify_inverse
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> forward = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> inverse = identify_inverse(recording, forward, hold_out=False)
    >>> inverse.rmse < 0.01  # V, of the drive
    True
    """
    return fit_inverse(
        swap(recording, forward),
        forward.ecdl.operator,
        plays=plays,
        order=order,
        each=each,
        starts=starts,
        hold_out=hold_out,
        max_steps=max_steps,
        throw=throw,
        progress=progress,
    )


def fit_inverse(
    swapped: Recording,
    forward: AbstractOperator,
    *,
    plays: int | None = None,
    order: int | None = None,
    each: tuple[str, ...] | None = None,
    starts: int = 2,
    hold_out: bool | tuple[str, ...] = HOLD_OUT,
    max_steps: int = 400,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """The same on a recording that is already swapped; `forward` gives the first guess."""
    one_loop = swapped.one_rate and len(swapped.amplitudes) == 1
    order = _default_order(one_loop) if order is None else order
    each = (() if one_loop else ("lam",)) if each is None else each
    guesses = InverseRAPI.guess_inverses(forward, swapped, plays=plays, order=order, each=each)
    first, *others = guesses
    result = fit(
        ECDL(first),
        swapped,
        starts=starts,
        guess=[ECDL(guess) for guess in others],
        drift=False,
        hold_out=hold_out,
        max_steps=max_steps,
        throw=False,
        progress=progress,
    )
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result


def _default_order(one_loop: bool) -> int:
    return THRESHOLDS.inverse_order_one_loop if one_loop else THRESHOLDS.inverse_order


def swapped_model(
    ecdl: ECDL, identified: Identified, response_unit: str, drive_unit: str
) -> Recording:
    """A swapped recording from a forward model alone: triangles over the range it was fitted in.

    For an inverse where only the model is at hand; without noise, and without what it lacks.
    """
    rates = identified.rates_hz or (1.0,)
    span = identified.drive_max - identified.drive_min
    drives = triangle(
        rates, amplitude=span, bias=identified.centre, samples=THRESHOLDS.inverse_samples
    )
    made = [np.asarray(predict(ecdl, drive)) for drive in drives]
    inputs = [dataclasses.replace(drive, value=y) for drive, y in zip(drives, made, strict=True)]
    sent = [drive.value for drive in drives]
    return Recording.of(inputs, sent, response_unit=drive_unit, drive_unit=response_unit)
