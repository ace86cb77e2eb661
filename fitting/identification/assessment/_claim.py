"""What a model may be expected to miss on data not seen, from runs that were left out."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.identification._thresholds import THRESHOLDS
from rapi_jax import ModelError, Recording

from ._cross_validation import HeldOut
from ._noise import Noise

_NUMBERS = ("rms", "low", "high", "noise", "curvature", "hours")


@dataclasses.dataclass(frozen=True)
class Claim:
    """The rms error to expect in a run like those recorded, in the response's unit.

    - `rms`: of the runs left out. `low`, `high`: the 95 % interval for another run's.
    - `noise`: of the readings of those runs, part of all three.
    - `curvature`: the rms of the response about a straight line in the drive, which compensation is
      to take away.
    - `rates_hz`, `swings`, `hours`: between which the runs lay, and how long the session was.
    - `runs`: how many errors the interval rests on.

    >>> from fitting import Claim
    >>> claim = Claim(
    ...     rms=0.024, low=0.011, high=0.049, noise=0.022, curvature=3.0,
    ...     rates_hz=(10.0, 40.0), swings=(2.5, 4.5), hours=0.01,
    ... )
    >>> claim.low < claim.rms < claim.high  # GHz
    True
    """

    rms: float
    low: float
    high: float
    noise: float
    curvature: float
    rates_hz: tuple[float, float]
    swings: tuple[float, float]
    hours: float
    runs: int = 1

    @classmethod
    def from_dict(cls, fields: dict[str, Any]) -> "Claim":
        """From `claim` in a `model.json`; raises `ModelError` where a part is missing."""
        try:
            numbers = {name: float(fields[name]) for name in _NUMBERS}
            ends = fields["rates_hz"], fields["swings"]
            rates, swings = ((float(low), float(high)) for low, high in ends)
            runs = int(fields.get("runs", 1))
        except (KeyError, TypeError, ValueError) as error:
            raise ModelError("its claim is not one this version reads. Fit it again.") from error
        return cls(**numbers, rates_hz=rates, swings=swings, runs=runs)

    def high_of(self, runs: int) -> float:
        """The 97.5 % limit for the largest error of `runs` new runs; `high` is that of one."""
        from scipy.special import stdtrit

        degrees = self.runs - 1 if self.runs > 1 else 1e9
        wider = float(stdtrit(degrees, 1.0 - 0.025 / runs) / stdtrit(degrees, 0.975))
        ratio = self.high / self.low if self.low > 0 else 1.0
        return self.high * ratio ** ((wider - 1.0) / 2.0)

    @property
    def gap(self) -> float:
        """What of `rms` is not noise."""
        return float(np.sqrt(max(self.rms**2 - self.noise**2, 0.0)))


def make_claim(
    recording: Recording, held_out: Sequence[HeldOut], noise: Noise, curvature: float
) -> Claim | None:
    """The claim that follows from runs left out one by one; of one run, from its last third.

    A run beyond the others in rate or swing that they do not predict says what extrapolation costs,
    and nothing of runs like those recorded. Errors of the other runs are taken as log-normal: a new
    run's lies within Student's t of their mean. `None` where nothing was left out.
    """
    span = max(run.span for run in recording.runs)
    errors = {
        h.runs: h.rmse
        for h in held_out
        if len(h.runs) == 1 and (h.inside or not (h.large and h.exceeds(noise.total, span)))
    }
    samples = float(np.mean(noise.use.sum(axis=1)))
    if len(errors) < 2:
        errors = {h.runs: h.rmse for h in held_out if h.scheme == "last third"}
    if not errors:
        return None
    found = np.array(list(errors.values()))
    rms = float(np.sqrt(np.mean(found**2)))
    low, high = _interval(found, samples) if found.all() else (rms, rms)
    rates, swings = recording.rates, recording.amplitudes
    drives = recording.drives
    end = max(float(d.start_s + d.time[-1]) for d in drives) - min(d.start_s for d in drives)
    rows = sorted({row for runs in errors for row in runs})
    own = float(np.sqrt(np.mean(noise.rms[rows] ** 2))) if rows else noise.total
    return Claim(
        rms, low, high, own, curvature,
        (min(rates), max(rates)), (min(swings), max(swings)), float(end) / 3600.0, found.size,
    )  # fmt: skip


def _interval(errors: np.ndarray, samples: float) -> tuple[float, float]:
    """The 95 % interval of another error of this kind; of one alone, three times either way.

    The rms of so many samples of white noise scatters by chance, as is known; what errors scatter
    beyond it is estimated from them, and has Student's t. Of two or three errors that reaches over
    decades: it is cut at a factor beyond the smallest and largest.
    """
    from scipy.special import ndtri, stdtrit

    middle, count = float(np.mean(np.log(errors))), errors.size
    if count == 1:
        return float(errors[0]) / 3.0, float(errors[0]) * 3.0
    chance = 1.0 / (2.0 * samples)
    beyond = max(float(np.var(np.log(errors), ddof=1)) - THRESHOLDS.claim_chance * chance, 0.0)
    normal, student = float(ndtri(0.975)), float(stdtrit(count - 1, 0.975))
    reach = np.sqrt((normal**2 * chance + student**2 * beyond) * (1.0 + 1.0 / count))
    most = THRESHOLDS.claim_reach
    low = max(float(np.exp(middle - reach)), float(errors.min()) / most)
    return low, min(float(np.exp(middle + reach)), float(errors.max()) * most)


def curvature(recording: Recording, use: Sequence[np.ndarray]) -> float:
    """The rms of the response about one straight line in the drive, each run with its origin.

    `use`: the samples of each run that count.
    """
    drives, responses = [], []
    for run, chosen in zip(recording.runs, use, strict=True):
        u = run.drive.delayed(recording.response_lag_s).value[chosen]
        y = run.response[chosen]
        drives.append(u - u.mean())
        responses.append(y - y.mean())
    u, y = np.concatenate(drives), np.concatenate(responses)
    square = float(u @ u)
    slope = float(u @ y) / square if square > 0 else 0.0
    return float(np.sqrt(np.mean((y - slope * u) ** 2)))
