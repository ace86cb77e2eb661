"""Compensation (Eq. 24): the drive that makes the response an ideal scan, within limits."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np

from rapi_jax._arguments import takes
from rapi_jax._ecdl import ECDL, predict
from rapi_jax._errors import LimitError, ModelError, NotInvertible
from rapi_jax._limits import DriveLimits
from rapi_jax._precision import as_float64, float64
from rapi_jax.display._compensation_plots import CompensationPlots
from rapi_jax.display._one_line import describe_compensation
from rapi_jax.display._results import compensation_dataset, summarise_compensation
from rapi_jax.effects import AbstractCouplingEffect, AbstractLawEffect
from rapi_jax.operators._inverse_rapi import InverseRAPI
from rapi_jax.recording._drive import Drive

from ._anderson import AndersonMixing
from ._compensation_iteration import Round, Scan, bracketed
from ._identified import Identified
from ._inverse_effects import drive_effects, law_of, refuse, steady, undo_effects
from ._target import Target
from ._thresholds import THRESHOLDS
from .certificate._certificate import Certificate
from .certificate._certify import certify


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Compensation:
    """A drive that is allowed, and what speaks for it.

    - `drive`: one period on the target's clock. `target`: the scan it is for.
    - `inverse`: "exact" or "paper".
    - `certificate`: for the exact inverse, what was proved about the model before the drive was
      made; for the paper's, what holds for the inverse operator itself.
    - `predicted`: the forward model's steady response, relative to its minimum; for the exact
      inverse the target, to about 1e-7 of its span (rms, with 8192 samples) with effects that have
      a memory, to rounding without. `None` for the paper's inverse, which knows no forward model.
    - `notes`: in which ways it goes beyond what was identified. `drive_unit`: of the drive.

    >>> from rapi_jax import DriveLimits, compensate, linear_scan
    >>> from rapi_jax.examples import paper_device
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> made = compensate(paper_device(), target, bias=3.0, limits=limits)
    >>> made.inverse, made.certificate.invertible, round(made.drive.u_pp, 2)  # V
    ('exact', True, 3.71)
    >>> list(made.to_dataset()), len(made.plot.drive().axes)
    (['drive', 'target', 'predicted'], 3)
    """

    drive: Drive
    target: Target
    inverse: str
    certificate: Certificate
    predicted: np.ndarray | None
    notes: tuple[str, ...]
    drive_unit: str = "V"

    def summary(self) -> str:
        """The drive and its certificate as text for people."""
        return summarise_compensation(self).text()

    def _repr_html_(self) -> str:
        return summarise_compensation(self).html()

    def __repr__(self) -> str:
        return describe_compensation(self)

    @property
    def plot(self) -> CompensationPlots:
        """Pictures: `made.plot.drive()`, `made.plot.error()`."""
        return CompensationPlots(self)

    def to_dataset(self) -> Any:
        """Drive, scan and the model's answer over one period as an `xarray.Dataset` with units."""
        return compensation_dataset(self)

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


@takes(ecdl=ECDL, target=Target, identified=Identified | None, limits=DriveLimits | None)
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
    - `bias`: the middle of the range of the drive that reaches the operator; by default that of
      `identified`, or of the limits.

    Where an effect has a memory, the error falls as the square of the sampling step: about 1e-7 of
    the span (rms) with 8192 samples and the usual corners, and some ten times the rms where a play
    comes into contact: there the drive through an amplifier's lag would have to jump. Sharp corners
    ask for a jump at every turn.

    Raises `NotInvertible` where the model is not monotone on the range needed, or has an effect
    that cannot be undone; `LimitError` where the drive would leave `limits`; `ModelError` where it
    leaves the identified range, or the target has another unit. A drive is refused whole, never
    clipped.

    >>> import numpy as np
    >>> from rapi_jax import DriveLimits, Run, compensate, linear_scan, linearity, predict
    >>> from rapi_jax.examples import paper_device
    >>> (target,) = linear_scan(20.0, span=60.0, samples=512)
    >>> limits = DriveLimits(low_v=0.0, high_v=7.0, slew_v_per_s=1000.0)
    >>> made = compensate(paper_device(), target, bias=3.0, limits=limits)
    >>> scan = linearity(Run(made.drive, np.asarray(predict(paper_device(), made.drive))))
    >>> max(scan.rms_ghz) < 1e-6  # GHz off a straight line
    True
    """
    if identified is not None and identified.response_unit not in ("", target.unit):
        raise ModelError(
            f"the target is in {target.unit}, but the model answers in {identified.response_unit}: "
            f"give `linear_scan(..., unit={identified.response_unit!r})`."
        )
    if limits is None:
        if identified is None:
            raise ValueError("Give `limits`, or `identified` from which to take them.")
        limits = identified.limits()
    elif identified is not None:
        limits = dataclasses.replace(limits, unit=identified.drive_unit)
    if bias is None:
        middle = (limits.low_v + limits.high_v) / 2
        bias = middle if identified is None else identified.centre
    if not limits.low_v < bias < limits.high_v:
        raise LimitError(
            f"the bias of {bias:g} {limits.unit} does not lie within the limits, {limits.low_v:g} "
            f"to {limits.high_v:g} {limits.unit}."
        )
    if identified is not None and not extrapolate:
        refuse_beyond(identified.other_rate(target.excitation_hz))
    if isinstance(ecdl.operator, InverseRAPI):
        value, certificate = _paper(ecdl, ecdl.operator, target, bias)
    else:
        seen = None if identified is None else (identified.drive_min, identified.drive_max)
        value, certificate, wanted = _exact(Scan(ecdl, target, bias, limits, seen))
    drive = Drive(target.time, value, target.excitation_hz, "triangle")
    limits.check(drive)
    beyond = [] if identified is None else identified.outside(drive)
    if identified is not None and beyond and not isinstance(ecdl.operator, InverseRAPI):
        _refuse_shrunk(ecdl, drive, identified)
    if not extrapolate:
        refuse_beyond(beyond)
    predicted = None
    if not isinstance(ecdl.operator, InverseRAPI):
        predicted = _followed(ecdl, drive, wanted)
        predicted = predicted - predicted.min()
    name = "paper" if predicted is None else "exact"
    return Compensation(drive, target, name, certificate, predicted, tuple(beyond), limits.unit)


def refuse_beyond(beyond: list[str]) -> None:
    """Raise `ModelError` where drives leave what the model has seen; `beyond` says how."""
    if beyond:
        raise ModelError(
            f"{'; '.join(beyond)}. Identify the model where it is to be used, or ask for "
            "extrapolation (`--extrapolate`, in Python `extrapolate=True`)."
        )


def _refuse_shrunk(ecdl: ECDL, drive: Drive, identified: Identified) -> None:
    """Raise `NotInvertible` for a drive below all recorded swings that only its swing makes work.

    Where a model does not rise with the drive at the thresholds of the recorded swings, a tiny
    drive may still solve its equations: thresholds shrink with the swing (Eq. 11), until all plays
    move and the slope is another.
    """
    swing = min(identified.amplitudes, default=0.0)
    if drive.u_pp < THRESHOLDS.least_swing * swing:
        ends = float(drive.value.min()), float(drive.value.max())
        found = certify(ecdl.operator, *ends, drive.rate, u_pp=swing)
        if not found.invertible:
            unit = identified.drive_unit
            raise NotInvertible(
                f"at {swing:.3g} {unit} peak to peak, at which it was identified, the model does "
                f"not rise with the drive (slope down to {found.slope_min:.4g} at "
                f"{found.slope_at:.4g} {unit}), so it has no inverse there. The drive found, of "
                f"{drive.u_pp:.3g} {unit}, follows the scan only since thresholds shrink with the "
                "swing in the model. Fit another operator (`--operator FixedRAPI`), or record "
                "more rates and swings and fit again."
            )


def _followed(ecdl: ECDL, drive: Drive, wanted: np.ndarray) -> np.ndarray:
    """The forward model's steady answer to `drive`, which must be `wanted`."""
    more = np.arange(drive.size + THRESHOLDS.wrapped_samples)
    value = np.take(drive.value, more, mode="wrap")
    longer = Drive(more * drive.step_s, value, drive.excitation_hz, drive.waveform)
    answer = np.asarray(predict(steady(ecdl), longer))[: drive.size]
    off = (answer - wanted) / np.ptp(wanted)
    rms = float(np.sqrt(np.mean(off**2)))
    if not rms <= THRESHOLDS.target_error:
        raise NotInvertible(
            f"the response to the drive found would be {rms:.2g} of the span off the scan (rms, "
            f"most after {drive.time[np.abs(off).argmax()]:.4g} s), and no more than "
            f"{THRESHOLDS.target_error:g} is accepted: the scan asks for more than a drive "
            "of this many samples holds. Round its corners more, or give the target more samples."
        )
    return answer


def _exact(scan: Scan) -> tuple[np.ndarray, Certificate, np.ndarray]:
    """The drive to send, what was proved, and the response wanted, with its origin."""
    ecdl, target, bias = scan.ecdl, scan.target, scan.bias
    refuse(ecdl.effects)
    time, rate = as_float64(target.time), target.excitation_hz
    coupled = any(isinstance(e, AbstractCouplingEffect) for e in ecdl.effects)
    law = law_of(ecdl, rate, scan.widest / 2, bias)
    state = Round.of(law, scan.widest / 2)
    mixing = AndersonMixing()
    for _ in range(THRESHOLDS.most_iterations):
        found = scan.at_operator(state)
        sent = np.asarray(undo_effects(drive_effects(ecdl), time, jnp.asarray(found.sampled)))
        low, high = float(sent.min()) - found.below, float(sent.max()) + found.above
        law = law_of(ecdl, rate, high - low, (low + high) / 2)
        new = Round.of(law, found.u_pp, sent if coupled else None)
        if new.is_as(state):
            return sent, scan.certified(found, state), target.value + found.begin
        last = state
        state = scan.next(mixing, state, new)
    scan.certified(found, last)
    kinds = AbstractCouplingEffect | AbstractLawEffect
    names = [e.name for e in ecdl.effects if isinstance(e, kinds)] or [e.name for e in ecdl.effects]
    raise NotInvertible(
        "the amplitude of the drive does not settle with these effects around the operator: each "
        "round changes the thresholds, or what couples into the response, again. Leave out "
        f"{' or '.join(names)} (`rapi compensate --without {names[0]}`, in Python "
        f"`ecdl.without({names[0]!r})`)."
    )


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
    offset = bracketed(error, middle, target.span / 8, 20 * target.span)
    low, high = offset, offset + target.span
    return drive(offset), certify(operator, low, high, target.excitation_hz)
