"""How much the response itself changed, and the gap that one model leaves before and after."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats

from fitting.diagnosis.noise._periods import decimate
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.where._gap import Gap, measure_gap
from fitting.diagnosis.which._base import measure_model_errors
from rapi_jax import ECDL, Recording

from ._differences import GapChange, Interval
from ._joint_fit import SharedErrors, Two, rms

_HALF = 1.959963984540054  # of a normal distribution, at the interval's level of 95 %


def response_change(
    errors: tuple[SharedErrors, SharedErrors], alone: Two, about: Two, covariances: Two
) -> Interval:
    r"""The rms of how much the response changed over the drives of both, its mean left out.

    An effect that one session alone has is a part of that change.

    With $D$ the difference of the two models `alone`, and $C$ the covariance of it by noise, noise
    alone makes $\langle D^2 \rangle$ about $\mathrm{tr}(C)/n$; that is taken off, and the interval
    is by the variance of a quadratic form. `covariances`: of the parameters of either, to first
    order at its own `about`. There their slopes are taken, too: what hardly moves the response at
    one place, and has a wide covariance there, may move it much at another.
    """
    before, after = alone
    change = np.concatenate([e.by_model(1, after) - e.by_model(0, before) for e in errors])
    noise = np.concatenate(
        [
            _response_noise(errors, session, *one)
            for session, one in enumerate(zip(about, covariances, strict=True))
        ],
        axis=1,
    )
    spread = noise.T @ noise / change.size
    along = noise.T @ change / change.size
    square = float(np.mean(change**2)) - float(np.trace(spread))
    error2 = 2.0 * float(np.sum(spread**2)) + 4.0 * float(along @ along)
    return _root_interval(square, float(np.sqrt(error2)))


def change_by_drive(
    errors: tuple[SharedErrors, SharedErrors], alone: Two, digits: int = 3
) -> list[dict[str, Any]]:
    """The rms of the change of the response at each rate and swing, both recordings together.

    Swings that are the same in so many digits are one. What noise makes of it is not taken off.
    """
    found: dict[tuple[float | None, float], list[np.ndarray]] = {}
    for one in errors:
        problem = one.problem
        ends = np.cumsum(problem.data.use.sum(axis=1))[:-1]
        parts = np.split(one.by_model(1, alone[1]) - one.by_model(0, alone[0]), ends)
        for drive, part in zip(problem.recording.drives, parts, strict=False):
            swing = float(f"{drive.u_pp:.{digits}g}")
            found.setdefault((drive.excitation_hz, swing), []).append(part)
    return [
        {"excitation_hz": rate, "amplitude": swing, "rms": rms(np.concatenate(parts))}
        for (rate, swing), parts in found.items()
    ]


def _response_noise(
    errors: tuple[SharedErrors, SharedErrors],
    session: int,
    at: Float[np.ndarray, " parameters"],
    covariance: Float[np.ndarray, "parameters parameters"],
) -> Float[np.ndarray, "samples parameters"]:
    """A square root of the covariance of a session's response over the drives of both."""
    steps = np.sqrt(np.diag(covariance))
    slopes = np.concatenate([e.slopes(at, steps, session) for e in errors])
    size, axes = np.linalg.eigh(covariance / np.outer(steps, steps))
    return (slopes * steps) @ (axes * np.sqrt(np.maximum(size, 0.0)))


class ModelErrors(NamedTuple):
    """What a model leaves of a recording: model less data, "periods phases" a run, and its noise.

    The rows are those of the runs of `whitened`.
    """

    whitened: WhitenedModel
    errors: list[np.ndarray]
    spectrum: Spectrum

    @classmethod
    def of(cls, ecdl: ECDL, recording: Recording) -> "ModelErrors":
        """Of a model as it is."""
        whitened = WhitenedModel.of(decimate(recording))
        return cls(whitened, *measure_model_errors(whitened, ecdl))


def gap_change(
    reference: str,
    left: tuple[ModelErrors, ModelErrors],
    *,
    fitted: tuple[int, int] = (0, 0),
) -> GapChange | None:
    """The gap that a model leaves above the noise before and after, and the test of a change of it.

    `left`: of each recording, by its model; `fitted`: how many parameters were fitted to it. `None`
    where nothing repeats in one, since noise cannot then be told from error. The models' constants
    are no error. The interval of the change is by those of the two (MOVER, Zou and Donner 2008).
    """
    gaps = [_measure(*one) for one in zip(left, fitted, strict=True)]
    before, after = gaps[0].noise_floor, gaps[1].noise_floor
    if before is None or after is None:
        return None
    one, two = (_root_interval(gap.structural2, gap.structural2_stderr) for gap in gaps)
    change = two.value - one.value
    low = change - np.hypot(two.value - two.low, one.high - one.value)
    high = change + np.hypot(two.high - two.value, one.value - one.low)
    error = max(float(np.hypot(gaps[0].structural2_stderr, gaps[1].structural2_stderr)), 1e-300)
    p = 2.0 * float(stats.norm.sf(abs(gaps[1].structural2 - gaps[0].structural2) / error))
    interval = Interval(change, float(low), float(high))
    return GapChange(reference, one, two, interval, (before, after), p)


def _measure(left: ModelErrors, fitted: int) -> Gap:
    whitened, errors, spectrum = left
    own = whitened.own_origin
    if not own:
        used = [e[b.use > 0] for e, b in zip(errors, whitened.blocks, strict=True)]
        mean = float(np.concatenate(used).mean())
        errors = [error - mean for error in errors]
    return measure_gap(errors, whitened.blocks, spectrum, own_origin=own, fitted=fitted)


def _root_interval(square: float, error: float) -> Interval:
    """The interval of a root mean square from that of the mean square."""
    value, low, high = (
        float(np.sqrt(max(x, 0.0)))
        for x in (square, square - _HALF * error, square + _HALF * error)
    )
    return Interval(value, low, high)
