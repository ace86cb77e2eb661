"""Compensation (Eq. 24): the drive that makes the response an ideal scan, within limits."""

import dataclasses
from collections.abc import Callable
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
from ._mixing import Mixing
from ._precision import as_float64, float64
from ._recording import Drive
from ._target import Target
from ._undo import (
    drive_effects,
    from_minimum,
    law_of,
    loop,
    refuse,
    response_effects,
    steady,
    undone,
)
from .effects import AbstractCouplingEffect, Law
from .operators import AbstractOperator
from .operators._inverse_rapi import InverseRAPI

_MOST_ROUNDS = 50
_SETTLED = 1e-8  # of the swing, far below `_CLOSE`: how still a drive must be that couples
_MORE = 4  # samples of the next period, so that the last one has a neighbour
_CLOSE = 1e-6  # of the span, rms: how near the whole model must come to the target
_EXACT = 1e-9  # of the span: how well an operator is inverted


@dataclasses.dataclass(frozen=True, eq=False)
class Compensation:
    """A drive that is allowed, and what speaks for it.

    - `drive`: one period on the target's clock. `target`: the scan it is for.
    - `inverse`: "exact" or "paper".
    - `certificate`: for the exact inverse, what was proved about the model before the drive was
      made; for the paper's, what holds for the inverse operator itself.
    - `predicted`: the forward model's steady response, relative to its minimum; for the exact
      inverse the target, to 1e-6 of its span (rms) with effects that have a memory, to rounding
      without. `None` for the paper's inverse, which knows no forward model.
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
    - `bias`: the middle of the range of the drive that reaches the operator; by default that of
      `identified`, or of the limits.

    Where an effect has a memory, a drive of finitely many samples follows to about their step: 1e-7
    of the span (rms) with 8192 samples and the usual corners, as the square of the step. At most it
    is off by some ten times that, where a play comes into contact: there the drive through an
    amplifier's lag would have to jump. Sharp corners ask for a jump at every turn.

    Raises `NotInvertible` where the model is not monotone on the range needed, or has an effect
    that cannot be undone; `LimitError` where the drive would leave `limits`; `ModelError` where it
    leaves the identified range. A drive is refused whole, never clipped.
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
        value, certificate, wanted = _exact(ecdl, target, bias, limits)
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
        predicted = _followed(ecdl, drive, wanted)
        predicted = predicted - predicted.min()
    name = "paper" if predicted is None else "exact"
    return Compensation(drive, target, name, certificate, predicted, tuple(beyond))


def _followed(ecdl: ECDL, drive: Drive, wanted: np.ndarray) -> np.ndarray:
    """The forward model's steady answer to `drive`, which must be `wanted`."""
    more = np.arange(drive.size + _MORE)
    value = np.take(drive.value, more, mode="wrap")
    longer = Drive(more * drive.step_s, value, drive.excitation_hz, drive.waveform)
    answer = np.asarray(predict(steady(ecdl), longer))[: drive.size]
    off = (answer - wanted) / np.ptp(wanted)
    rms = float(np.sqrt(np.mean(off**2)))
    if not rms <= _CLOSE:
        raise NotInvertible(
            f"the response to the drive found would be {rms:.2g} of the span off the scan (rms, "
            f"most after {drive.time[np.abs(off).argmax()]:.4g} s), and no more than {_CLOSE:g} is "
            "accepted: the scan asks for more than a drive of this many samples holds. Round its "
            "corners more, or give the target more samples."
        )
    return answer


def _exact(
    ecdl: ECDL, target: Target, bias: float, limits: DriveLimits
) -> tuple[np.ndarray, Certificate, np.ndarray]:
    """The drive to send, what was proved, and the response wanted, with its origin."""
    refuse(ecdl.effects)
    time, rate = as_float64(target.time), target.excitation_hz
    scan = _Scan(ecdl, target, bias, limits)
    coupled = any(isinstance(e, AbstractCouplingEffect) for e in ecdl.effects)
    law = law_of(ecdl, rate, scan.widest / 2, bias)
    state = _Round.of(law, scan.widest / 2)
    mixing = Mixing()
    for _ in range(_MOST_ROUNDS):
        found = scan.at_operator(state)
        sent = np.asarray(undone(drive_effects(ecdl), time, jnp.asarray(found.sampled)))
        low, high = float(sent.min()) - found.below, float(sent.max()) + found.above
        law = law_of(ecdl, rate, high - low, (low + high) / 2)
        new = _Round.of(law, found.u_pp, sent if coupled else None)
        if new.is_as(state):
            return sent, scan.certified(found, state), target.value + found.begin
        last = state
        state = scan.next(mixing, state, new)
    scan.certified(found, last)
    raise NotInvertible(
        "the amplitude of the drive does not settle with these effects around the operator: each "
        "round changes the thresholds, or what couples into the response, again. Leave out the "
        "strongest of them."
    )


class _Round(NamedTuple):
    """What a round takes from the one before it.

    - `freq`, `ratio`, `gain`, `offset`: what the operator's laws see of the run; `ratio` is their
      peak-to-peak drive over that which reaches the operator.
    - `sent`: the drive that couples into the response; `None` without couplings, and at first.
    """

    freq: float
    ratio: float
    gain: float
    offset: float
    sent: np.ndarray | None = None

    @classmethod
    def of(cls, law: Law, u_pp: float, sent: np.ndarray | None = None) -> "_Round":
        """The laws of a run in which `u_pp` reaches the operator."""
        freq, ratio = float(law.freq), float(law.u_pp) / u_pp
        return cls(freq, ratio, float(law.gain), float(law.offset), sent)

    @property
    def law(self) -> Law:
        """The part that acts on the response."""
        numbers = (self.freq, self.ratio, self.gain, self.offset)
        return Law(*(as_float64(x) for x in numbers))

    def is_as(self, last: "_Round") -> bool:
        """Whether nothing has moved since the `last` round."""
        if (self.sent is None) != (last.sent is None):
            return False
        still = 1e-12
        if self.sent is not None and last.sent is not None:
            still = _SETTLED
            if not np.abs(self.sent - last.sent).max() < _SETTLED * np.ptp(self.sent):
                return False
        most = max(abs(self.freq / last.freq - 1), abs(self.ratio - last.ratio))
        moved = abs(self.offset - last.offset) / max(abs(self.offset), 1e-300)
        return max(most, moved, abs(self.gain - last.gain)) < still


class _Found(NamedTuple):
    """The drive that must reach the operator, from where its answer is smallest.

    - `drive`, `wanted`: with sharp turning points between samples, which are at `place`.
    - `begin`: of the scan, response unit.
    """

    drive: np.ndarray
    wanted: np.ndarray
    place: np.ndarray
    begin: float
    u_min: Any
    u_max: Any

    @property
    def sampled(self) -> np.ndarray:
        """On the samples of the target."""
        return self.drive[self.place]

    @property
    def u_pp(self) -> float:
        return float(self.u_max - self.u_min)

    @property
    def below(self) -> float:
        """By how much the drive goes below its lowest sample, at a turn between two."""
        return float(self.sampled.min() - self.u_min)

    @property
    def above(self) -> float:
        """By how much it goes above its highest."""
        return float(self.u_max - self.sampled.max())


class _Scan(NamedTuple):
    """What is asked for."""

    ecdl: ECDL
    target: Target
    bias: float
    limits: DriveLimits

    @property
    def widest(self) -> float:
        """Of all peak-to-peak drives about the bias, the largest within the limits."""
        return 2.0 * min(self.bias - self.limits.low_v, self.limits.high_v - self.bias)

    def at_operator(self, state: _Round) -> _Found:
        """The drive that must reach the operator, its laws and couplings as `state` has them."""
        operator, time = self.ecdl.operator, as_float64(self.target.time)
        after = response_effects(self.ecdl)
        constant = getattr(operator, operator.fields.constant)

        def wanted(offset: float) -> tuple[np.ndarray, np.ndarray]:
            """What the operator must answer for the scan to begin at `offset`."""
            signal = undone(after, time, as_float64(self.target.value + offset), state.sent)
            return from_minimum(np.asarray(state.law.before(signal, constant)))

        span, bias, most, rate, ratio = (
            as_float64(x)
            for x in (
                self.target.span / state.gain, self.bias, self.widest, state.freq, state.ratio
            )
        )  # fmt: skip
        u_min, u_max = placed(operator, span, bias, rate, most, ratio)
        least = at_minimum(operator, u_min, operator.plays(ratio * (u_max - u_min), rate))
        begin = float(state.law.after(least, constant))
        if after:
            ends = _Ends(operator, wanted, rate, self.limits, ratio)
            span = self.target.span
            begin = _bracketed(
                lambda offset: ends(offset)[0] - self.bias, begin, span / 32, 20 * span
            )
            _, u_min, u_max = ends(begin)
        y, place = wanted(begin)
        u = np.asarray(scan_inverse(operator, jnp.asarray(y), rate, u_min, u_max, ratio))
        return _Found(u, y, place, begin, u_min, u_max)

    def next(self, mixing: Mixing, last: _Round, new: _Round) -> _Round:
        """The next round, where `last` led to `new`, which couples into its own response."""
        if new.sent is None:
            return new
        size, swing = new.sent.size, float(np.ptp(new.sent))
        back = loop(self.ecdl, as_float64(self.target.time), new.sent, self.target.span / swing)
        if last.sent is None:  # the first drive knew of no coupling
            return new._replace(sent=np.fft.irfft(np.fft.rfft(new.sent) / (1.0 + back), size))
        change = np.fft.rfft(new.sent - last.sent) / (1.0 + back)
        sent = last.sent + np.fft.irfft(change, size)
        before, after = (
            np.append(drive, self._numbers(r)) for drive, r in ((last.sent, last), (sent, new))
        )
        found = mixing.next(before, after)
        numbers = found[-4:] / self._scale
        freq, ratio, gain, offset = (float(x) for x in numbers)
        return _Round(freq, ratio, gain, offset, found[:-4])

    @property
    def _scale(self) -> np.ndarray:
        """Volts for each number of a round."""
        return self.widest / np.array([1.0, 1.0, 1.0, self.target.span])

    def _numbers(self, state: _Round) -> np.ndarray:
        return self._scale * np.array([state.freq, state.ratio, state.gain, state.offset])

    def certified(self, found: _Found, state: _Round) -> Certificate:
        """What is proved about the operator on the range found, which must lie within the limits.

        The drive found must answer what is wanted there, to rounding.
        """
        operator, u_pp = self.ecdl.operator, state.ratio * found.u_pp
        low, high = float(found.u_min), float(found.u_max)
        certificate = certify(operator, low, high, state.freq, u_pp=u_pp)
        certificate.require()
        if found.u_pp >= self.widest * (1 - 1e-12):
            raise LimitError(
                f"a scan of {self.target.span:g} about {self.bias:g} V at "
                f"{self.target.excitation_hz:g} Hz needs more than {self.widest:.4g} V peak to "
                f"peak, which is all that the limits {self.limits.low_v:.4g} to "
                f"{self.limits.high_v:.4g} V leave there. Scan less, or move the bias."
            )
        rate, u_pp, u_min = (as_float64(x) for x in (state.freq, u_pp, low))
        answer = np.asarray(operator(jnp.asarray(found.drive), rate, u_pp=u_pp, u_min=u_min))
        off = float(np.abs(answer - found.wanted).max())
        if not off <= _EXACT * self.target.span:
            raise NotInvertible(
                f"the drive found answers the scan only to {off:.3g} of {self.target.span:g}. This "
                "should not happen for a certified model: please report it with the model file."
            )
        return certificate


class _Ends(NamedTuple):
    """Centre and ends of the drive for a scan that begins at an offset, effects undone."""

    operator: AbstractOperator
    wanted: Callable[[float], tuple[np.ndarray, np.ndarray]]
    rate: Any
    limits: DriveLimits
    ratio: Any

    def __call__(self, offset: float) -> tuple[float, Any, Any]:
        y = jnp.asarray(self.wanted(offset)[0])
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
