"""One round of an exact compensation: the drive for a scan, by the laws of the round before.

Effects around the operator see the drive that is looked for (its amplitude, its couplings), so it
is found in rounds that settle.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from rapi_jax._ecdl import ECDL, predict
from rapi_jax._errors import LimitError, ModelError, NotInvertible
from rapi_jax._limits import DriveLimits
from rapi_jax._precision import as_float64
from rapi_jax._waveform import triangle
from rapi_jax.effects import Law
from rapi_jax.operators import AbstractOperator

from ._anderson import AndersonMixing
from ._exact_inverse import (
    at_minimum,
    drive_range_for_span,
    extremes,
    scan_inverse,
    target_stretches,
)
from ._inverse_effects import from_minimum, loop, response_effects, steady, undo_effects
from ._target import Target
from ._thresholds import THRESHOLDS
from .certificate._certificate import Certificate
from .certificate._certify import certify


class Round(NamedTuple):
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
    def of(cls, law: Law, u_pp: float, sent: np.ndarray | None = None) -> "Round":
        """The laws of a run in which `u_pp` reaches the operator."""
        freq, ratio = float(law.freq), float(law.u_pp) / u_pp
        return cls(freq, ratio, float(law.gain), float(law.offset), sent)

    @property
    def law(self) -> Law:
        """The part that acts on the response."""
        numbers = (self.freq, self.ratio, self.gain, self.offset)
        return Law(*(as_float64(x) for x in numbers))

    def is_as(self, last: "Round") -> bool:
        """Whether nothing has moved since the `last` round."""
        if (self.sent is None) != (last.sent is None):
            return False
        still = 1e-12
        if self.sent is not None and last.sent is not None:
            still = THRESHOLDS.coupling_change
            if not np.abs(self.sent - last.sent).max() < THRESHOLDS.coupling_change * np.ptp(
                self.sent
            ):
                return False
        most = max(abs(self.freq / last.freq - 1), abs(self.ratio - last.ratio))
        moved = abs(self.offset - last.offset) / max(abs(self.offset), 1e-300)
        return max(most, moved, abs(self.gain - last.gain)) < still


class Found(NamedTuple):
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


class Scan(NamedTuple):
    """What is asked for."""

    ecdl: ECDL
    target: Target
    bias: float
    limits: DriveLimits
    recorded: tuple[float, float] | None = None  # lowest and highest drive of the identification

    @property
    def widest(self) -> float:
        """Of all peak-to-peak drives about the bias, the largest within the limits."""
        return 2.0 * min(self.bias - self.limits.low_v, self.limits.high_v - self.bias)

    def at_operator(self, state: Round) -> Found:
        """The drive that must reach the operator, its laws and couplings as `state` has them."""
        operator, time = self.ecdl.operator, as_float64(self.target.time)
        after = response_effects(self.ecdl)
        constant = getattr(operator, operator.fields.constant)

        def wanted(offset: float) -> tuple[np.ndarray, np.ndarray]:
            """What the operator must answer for the scan to begin at `offset`."""
            signal = undo_effects(after, time, as_float64(self.target.value + offset), state.sent)
            return from_minimum(np.asarray(state.law.before(signal, constant)))

        span, bias, most, rate, ratio = (
            as_float64(x)
            for x in (
                self.target.span / state.gain, self.bias, self.widest, state.freq, state.ratio
            )
        )  # fmt: skip
        u_min, u_max = drive_range_for_span(operator, span, bias, rate, most, ratio)
        least = at_minimum(operator, u_min, operator.plays(ratio * (u_max - u_min), rate))
        begin = float(state.law.after(least, constant))
        if not np.isfinite(begin):
            self._refuse_range(float(u_min), float(u_max))
        if after:
            ends = _Ends(operator, wanted, rate, self.limits, ratio)
            span = self.target.span
            try:
                begin = bracketed(
                    lambda offset: ends(offset)[0] - self.bias, begin, span / 32, 20 * span
                )
            except ModelError as error:
                if self.reached(self.widest) < span:
                    raise LimitError(self.too_wide()) from error
                raise
            _, u_min, u_max = ends(begin)
        y, place = wanted(begin)
        stretches = target_stretches(as_float64(y))
        u = np.asarray(scan_inverse(operator, jnp.asarray(y), rate, u_min, u_max, ratio, stretches))
        return Found(u, y, place, begin, u_min, u_max)

    def reached(self, swing: float, bias: float | None = None) -> float:
        """Peak to peak of the model's response to a triangle of `swing`, at the target's rate."""
        bias = self.bias if bias is None else bias
        (drive,) = triangle(self.target.excitation_hz, amplitude=swing, bias=bias)
        return float(np.ptp(np.asarray(predict(steady(self.ecdl), drive))))

    def too_wide(self) -> str:
        """What a span larger than the drive allows asks for, what is reached, and what to do."""
        unit, of = self.limits.unit, self.target.unit
        text = (
            f"a scan of {self.target.span:g} {of} centred on {self.bias:.4g} {unit} at "
            f"{self.target.excitation_hz:g} Hz needs more than {self.widest:.4g} {unit} peak "
            f"to peak, which is all that the limits {self.limits.low_v:.4g} to "
            f"{self.limits.high_v:.4g} {unit} leave there: by the model it reaches "
            f"{self.reached(self.widest):.4g} {of}"
        )
        if self.recorded is not None:
            low, high = self.recorded
            text += (
                f", and the recordings, {low:.4g} to {high:.4g} {unit}, span "
                f"{self.reached(high - low, (low + high) / 2):.4g} {of}"
            )
        return (
            f"{text}. Ask for a smaller span or move the bias; for a larger span, record runs that "
            "swing farther, and fit again."
        )

    def next(self, mixing: AndersonMixing, last: Round, new: Round) -> Round:
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
        return Round(freq, ratio, gain, offset, found[:-4])

    @property
    def _scale(self) -> np.ndarray:
        """Volts for each number of a round."""
        return self.widest / np.array([1.0, 1.0, 1.0, self.target.span])

    def _numbers(self, state: Round) -> np.ndarray:
        return self._scale * np.array([state.freq, state.ratio, state.gain, state.offset])

    def certified(self, found: Found, state: Round) -> Certificate:
        """What is proved about the operator on the range found, which must lie within the limits.

        The drive found must answer what is wanted there, to rounding.
        """
        operator, u_pp = self.ecdl.operator, state.ratio * found.u_pp
        low, high = float(found.u_min), float(found.u_max)
        if not (low < high and np.isfinite([low, high]).all() and np.isfinite(found.drive).all()):
            self._refuse_range(low, high)
        certificate = certify(operator, low, high, state.freq, u_pp=u_pp)
        certificate.require()
        if found.u_pp >= self.widest * (1 - 1e-12):
            raise LimitError(self.too_wide())
        rate, u_pp, u_min = (as_float64(x) for x in (state.freq, u_pp, low))
        answer = np.asarray(operator(jnp.asarray(found.drive), rate, u_pp=u_pp, u_min=u_min))
        off = float(np.abs(answer - found.wanted).max())
        if not off <= THRESHOLDS.inverse_error * self.target.span:
            if self.reached(self.widest) < self.target.span:
                raise LimitError(self.too_wide())
            raise NotInvertible(
                f"the drive found answers the scan only to {off:.3g} of {self.target.span:g} "
                f"{self.target.unit}. This should not happen for a certified model: please report "
                "it with the model file."
            )
        return certificate

    def _refuse_range(self, low: float, high: float) -> None:
        """Raise where no range of the drive was found that gives the span."""
        if self.reached(self.widest) < self.target.span:
            raise LimitError(self.too_wide())
        raise NotInvertible(
            f"no range of the drive was found that scans {self.target.span:g} {self.target.unit} "
            f"(it would go from {low:.4g} to {high:.4g} {self.limits.unit}): the model does not "
            "rise with its drive there. Ask for a smaller span."
        )


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


def bracketed(f: Callable[[float], float], at: float, reach: float, most: float) -> float:
    """Where the increasing `f` is zero, looked for ever farther from `at`."""
    from scipy.optimize import root_scalar

    while f(at - reach) > 0 or f(at + reach) < 0:
        reach *= 1.5
        if reach > most:
            raise ModelError(
                "no scan of this span has its drive centred on the bias: the span is larger than "
                "what the model saw, or the bias lies far from it. Ask for a smaller span, or "
                "choose a bias near those at which the model was identified."
            )
    return float(root_scalar(f, bracket=(at - reach, at + reach), method="brentq", xtol=1e-9).root)
