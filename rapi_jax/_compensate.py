"""Compensation (Eq. 24): the drive that makes the response an ideal scan, within limits."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.optimize import root_scalar

from ._certificate import Certificate, NotInvertible, certify
from ._ecdl import ECDL, predict
from ._errors import ModelError
from ._identified import Identified
from ._invert import at_minimum, extremes, placed, scan_inverse
from ._limits import DriveLimits, LimitError
from ._precision import as_float64, float64
from ._recording import Drive
from ._target import Target
from .effects import AbstractDriveEffect, AbstractEffect, AbstractInvertible, AbstractOpticalEffect
from .operators import AbstractOperator
from .operators._inverse_rapi import InverseRAPI

_MOST_ROUNDS = 50


@dataclasses.dataclass(frozen=True, eq=False)
class Compensation:
    """A drive that is allowed, and what speaks for it.

    - `drive`: one period, from its minimum. `target`: the scan it is for.
    - `inverse`: "exact" or "paper".
    - `certificate`: for the exact inverse, what was proved about the model before the drive was
      made; for the paper's, what holds for the inverse operator itself.
    - `predicted`: the forward model's response, relative to its minimum; for the exact inverse the
      target to rounding. `None` for the paper's inverse, which knows no forward model.
    - `notes`: in which ways it goes beyond what was identified.
    """

    drive: Drive
    target: Target
    inverse: str
    certificate: Certificate
    predicted: np.ndarray | None
    notes: tuple[str, ...]

    @property
    def bias(self) -> float:
        """The middle of the drive's range."""
        return float(self.drive.value.min() + self.drive.value.max()) / 2

    def to_dict(self) -> dict[str, Any]:
        """What a person or a program wants to know about the drive, without its samples."""
        d = self.drive
        return {
            "excitation_hz": d.rate,
            "span": self.target.span,
            "samples": d.size,
            "inverse": self.inverse,
            "drive_min": float(d.value.min()),
            "drive_max": float(d.value.max()),
            "bias": self.bias,
            "u_pp": d.u_pp,
            "slew_max": float(np.abs(np.diff(d.value, append=d.value[0])).max() / d.step_s),
            "closing_step": float(d.value[0] - d.value[-1]),
            "certificate": self.certificate.to_dict(),
            "notes": list(self.notes),
        }


@float64
def compensate(
    ecdl: ECDL,
    target: Target,
    *,
    identified: Identified | None = None,
    limits: DriveLimits | None = None,
    bias: float | None = None,
    extrapolate: bool = False,
) -> Compensation:
    """The drive under which the device that `ecdl` describes follows `target`.

    **Arguments:**

    - `ecdl`: a forward model, inverted exactly with its effects; or one whose operator is an
      `InverseRAPI`, the paper's inverse, applied as it is.
    - `identified`: what the model has seen. A drive beyond it is refused, unless `extrapolate`.
    - `limits`: what the device may be given. By default `identified.limits()`.
    - `bias`: the middle of the drive's range; by default that of `identified`, or of the limits.

    Raises `NotInvertible` where the model is not monotone on the range needed, `LimitError` where
    the drive would leave `limits`, `ModelError` where it leaves the identified range or an
    effect cannot be undone. A drive is refused whole, never clipped.
    """
    if limits is None:
        if identified is None:
            raise ValueError("Give `limits`, or `identified` from which to take them.")
        limits = identified.limits()
    if bias is None:
        middle = (limits.low_v + limits.high_v) / 2
        bias = middle if identified is None else identified.centre
    if not limits.low_v < bias < limits.high_v:
        raise LimitError(
            f"the bias of {bias:g} V does not lie within the limits, {limits.low_v:g} to "
            f"{limits.high_v:g} V."
        )
    if isinstance(ecdl.operator, InverseRAPI):
        value, certificate = _paper(ecdl, ecdl.operator, target, bias)
    else:
        value, certificate = _exact(ecdl, target, bias, limits)
    drive = Drive(target.time, value, target.excitation_hz, "triangle")
    limits.check(drive)
    beyond = [] if identified is None else identified.outside(drive)
    if beyond and not extrapolate:
        raise ModelError(
            f"{'; '.join(beyond)}. Identify the model where it is to be used, or ask for "
            "extrapolation."
        )
    predicted = None
    if not isinstance(ecdl.operator, InverseRAPI):
        predicted = np.asarray(predict(ecdl, drive))
        predicted = predicted - predicted.min()
    name = "paper" if predicted is None else "exact"
    return Compensation(drive, target, name, certificate, predicted, tuple(beyond))


def _exact(
    ecdl: ECDL, target: Target, bias: float, limits: DriveLimits
) -> tuple[np.ndarray, Certificate]:
    before = [e for e in ecdl.effects if isinstance(e, AbstractDriveEffect)]
    time = as_float64(target.time)
    ratio = 1.0  # of the peak-to-peak drive sent, which sets thresholds, to what the operator sees
    for _ in range(_MOST_ROUNDS):
        u, certificate = _at_operator(ecdl, target, bias, limits, ratio)
        sent = np.asarray(_undone(before, time, u))
        last, ratio = ratio, float(np.ptp(sent) / np.ptp(u))
        if abs(ratio - last) < 1e-12:
            return sent, certificate
    raise NotInvertible(
        "the amplitude of the drive does not settle with these effects before the operator: each "
        "round changes the thresholds again. Leave out the strongest of them."
    )


def _at_operator(
    ecdl: ECDL, target: Target, bias: float, limits: DriveLimits, share: float
) -> tuple[np.ndarray, Certificate]:
    """The drive that must reach the operator, and its certificate."""
    operator = ecdl.operator
    after = [e for e in ecdl.effects if isinstance(e, AbstractOpticalEffect)]
    widest = 2.0 * min(bias - limits.low_v, limits.high_v - bias)
    time, span, centre, most, rate, ratio = (
        as_float64(x) for x in (target.time, target.span, bias, widest, target.excitation_hz, share)
    )

    def wanted(offset: float) -> Any:
        """What the operator must answer for the scan to begin at `offset`."""
        return _undone(after, time, as_float64(target.value + offset))

    u_min, u_max = placed(operator, span, centre, rate, most, ratio)
    begin = float(at_minimum(operator, u_min, operator.plays(ratio * (u_max - u_min), rate)))
    if after:
        ends = _Ends(operator, wanted, rate, limits, ratio)
        begin = _bracketed(lambda offset: ends(offset)[0] - bias, begin, 1.0, 1e6)
        _, u_min, u_max = ends(begin)
    y = wanted(begin)
    u_pp = share * float(u_max - u_min)
    certificate = certify(operator, float(u_min), float(u_max), target.excitation_hz, u_pp=u_pp)
    certificate.require()
    if float(u_max - u_min) >= widest * (1 - 1e-12):
        raise LimitError(
            f"a scan of {target.span:g} about {bias:g} V at {target.excitation_hz:g} Hz needs more "
            f"than {widest:.4g} V peak to peak, which is all that the limits {limits.low_v:.4g} to "
            f"{limits.high_v:.4g} V leave there. Scan less, or move the bias."
        )
    u = scan_inverse(operator, y, rate, u_min, u_max, ratio)
    off = np.abs(np.asarray(operator(u, rate, u_pp=as_float64(u_pp), u_min=u_min) - y)).max()
    if not off <= 1e-9 * target.span:
        raise NotInvertible(
            f"the drive found answers the scan only to {off:.3g} of {target.span:g}. This should "
            "not happen for a certified model: please report it with the model file."
        )
    return np.asarray(u), certificate


class _Ends(NamedTuple):
    """Centre and ends of the drive for a scan that begins at an offset, effects undone."""

    operator: AbstractOperator
    wanted: Callable[[float], Any]
    rate: Any
    limits: DriveLimits
    ratio: Any

    def __call__(self, offset: float) -> tuple[float, Any, Any]:
        y = self.wanted(offset)
        low, high = as_float64(self.limits.low_v), as_float64(self.limits.high_v)
        u_min, u_max = extremes(
            self.operator, jnp.min(y), jnp.max(y), self.rate, low, high, self.ratio
        )
        return float(u_min + u_max) / 2, u_min, u_max


def _bracketed(f: Callable[[float], float], at: float, reach: float, most: float) -> float:
    """Where the increasing `f` is zero, looked for ever farther from `at`."""
    while f(at - reach) > 0 or f(at + reach) < 0:
        reach *= 1.5
        if reach > most:
            raise ModelError(
                "no scan of this span has its drive centred on the bias. Choose a bias near those "
                "at which the model was identified."
            )
    return float(root_scalar(f, bracket=(at - reach, at + reach), method="brentq", xtol=1e-9).root)


def _undone(effects: Sequence[AbstractEffect], time: Any, signal: Any) -> Any:
    """`signal` before the effects, which act in order."""
    for effect in reversed(effects):
        if not isinstance(effect, AbstractInvertible):
            raise NotInvertible(
                f"the effect {type(effect).__name__} cannot be undone, so no drive allows for it. "
                "Leave it out of the model to compensate without it."
            )
        signal = effect.inverse(time, signal)
    return signal


def _paper(
    ecdl: ECDL, operator: InverseRAPI, target: Target, bias: float
) -> tuple[np.ndarray, Certificate]:
    """The paper's inverse applied to the scan, placed so that the drive is centred (Eq. 24)."""

    def drive(offset: float) -> np.ndarray:
        scan = Drive(target.time, target.value + offset, target.excitation_hz, "triangle")
        return np.asarray(predict(ecdl, scan))  # Eq. (24)

    def error(offset: float) -> float:
        u = drive(offset)
        return float(u.min() + u.max()) / 2 - bias

    middle = float(operator.v_0) - target.span / 2
    offset = _bracketed(error, middle, target.span / 8, 20 * target.span)
    low, high = offset, offset + target.span
    return drive(offset), certify(operator, low, high, target.excitation_hz)
