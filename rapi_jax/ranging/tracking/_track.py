"""Track a target: signs by hypotheses, noise by likelihood, then filter and smoother."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rapi_jax._errors import DataError
from rapi_jax._precision import float64

from . import _kalman
from ._estimates import first_state, floored, leave_one_out, smoothed_states
from ._hypotheses import Best, Prior, best_path
from ._likelihood import estimate_noise
from ._observations import Observations
from ._thresholds import THRESHOLDS, TrackingThresholds

# Pairs of intensity and scale at which signs are sought: far apart at first, then about the best.
_FIRST = (
    10.0 ** np.concatenate([np.linspace(-18.0, -2.0, 9), np.tile([-18.0, -12.0, -8.0], 3)]),
    10.0 ** np.concatenate([np.zeros(9), np.repeat([1.0, 2.0, 3.0], 3)]),
)
_NEAR = 10.0 ** np.tile(np.linspace(-1.0, 1.0, 9), 2), 2.0 ** np.repeat([0.0, 1.0], 9)
_ROUNDS = 4  # of gating

Values = Float[np.ndarray, " scans"]


@dataclasses.dataclass(frozen=True, eq=False)
class Track:
    """Distance and velocity of a target at its scans' middles, given all scans.

    - `time_s` (s); `distance`, `distance_stderr` (m); `velocity`, `velocity_stderr` (m/s).
    - `sign`: of the apparent distance, +1 or -1. `gated`: scans that do not count, as outliers or
      because their sign is open (`folded`).
    - `changes`: scans before which the motion changed: a manoeuvre, or a jump of the target.
    - `odds`: of this track over the best other one that the scans allow.
    - `intensity`: of the process noise, m^2/s^3 (order 1) or m^2/s^5 (order 2), with a 95 %
      interval by likelihood ratio; `scale`: factor on the stated errors, 1 unless refuted.
    - `vibration`: rms velocity from scan to scan, m/s, where the scatter is beyond what the stated
      errors can be wrong by; part of `velocity_stderr`, and 0 elsewhere.
    - `nis`: normalised innovation squared, one degree of freedom; NaN at scans that do not count.
    - `notes`: what a reader should know, as sentences.
    """

    time_s: Values
    distance: Values
    distance_stderr: Values
    velocity: Values
    velocity_stderr: Values
    sign: Int[np.ndarray, " scans"]
    gated: Bool[np.ndarray, " scans"]
    folded: Bool[np.ndarray, " scans"]
    changes: tuple[int, ...]
    odds: float
    intensity: float
    intensity_interval: tuple[float, float]
    scale: float
    vibration: float
    nis: Values
    notes: tuple[str, ...]


@float64
def track(
    observations: Observations,
    *,
    order: int = 1,
    intensity: float | None = None,
    expected_m: tuple[float, float] | None = None,
) -> Track:
    """Distance and velocity of a target from the apparent distances of its scans.

    A Kalman filter and Rauch-Tung-Striebel smoother; the sign of each scan, outliers and changes of
    motion are chosen by likelihood among hypotheses, and so are the process noise and, where the
    stated errors are refuted, a common scale of these.

    **Arguments:**

    - `observations`: the scans, at least 3, in the order of time.
    - `order`: 1, constant velocity but for white noise of acceleration; 2, constant acceleration
      but for white noise of jerk.
    - `intensity`: of that noise, m^2/s^3 or m^2/s^5; found by maximum likelihood where left out.
    - `expected_m`: lowest and highest distance to be considered, m; any positive one by default.

    Raises `DataError` for an order, intensity or range that cannot be.
    """
    _check(order, intensity, expected_m)
    limits = THRESHOLDS
    size = observations.size
    scans, apparent, real = _padded(observations, order, limits)
    prior = _prior(observations, order, expected_m, limits)
    coarse = floored(scans, prior, limits)
    best, noise = _resolve(coarse, apparent, real, prior, intensity, size, limits)
    use, sign, folded = best.use.copy(), best.sign.copy(), np.zeros(size, dtype=bool)
    for number in range(_ROUNDS):
        choice = _choice(apparent, sign, use, best, size, limits)
        start = first_state(scans, choice, prior, noise, limits)
        noise = estimate_noise(scans, choice, start, limits, intensity)
        mean, cov, nis = smoothed_states(scans, choice, start, noise, limits)
        expected, spread = leave_one_out(scans, choice, mean, cov, noise.scale)
        verdict = _judge(observations.apparent_m, expected[:size], spread[:size], limits)
        folded = folded | (verdict.open_sign & use)
        new_use, sign_before, sign = use & ~verdict.open_sign & ~verdict.outlier, sign, verdict.sign
        if new_use.sum() < order + 1:
            raise DataError(
                f"{new_use.sum()} of {size} scans are left to track with; the others are outliers, "
                "or of either sign. Check the errors and Doppler gains, or record more scans."
            )
        settled = (new_use == use).all() and (sign == sign_before)[use].all()
        if settled or number == _ROUNDS - 1:
            break
        use = new_use
    vibration = _vibration(observations, use, noise.scale, limits)
    changes = tuple(int(k) for k in np.flatnonzero(best.change))
    odds = float(np.exp(min(best.log_odds, 700.0)))
    return Track(
        time_s=observations.time_s,
        distance=mean[:size, 0],
        distance_stderr=np.sqrt(cov[:size, 0, 0]),
        velocity=mean[:size, 1],
        velocity_stderr=np.hypot(np.sqrt(cov[:size, 1, 1]), vibration),
        sign=sign,
        gated=~use,
        folded=folded,
        changes=changes,
        odds=odds,
        intensity=noise.intensity,
        intensity_interval=noise.interval,
        scale=noise.scale,
        nis=np.where(use, nis[:size], np.nan),
        vibration=vibration,
        notes=_notes(observations, use, folded, best, odds, noise.scale, vibration, limits),
    )


def _check(order: int, intensity: float | None, expected_m: tuple[float, float] | None) -> None:
    if order not in (1, 2):
        raise DataError(f"`order` must be 1 or 2, but is {order}.")
    if intensity is not None and not (np.isfinite(intensity) and intensity > 0):
        raise DataError(f"`intensity` must be a positive number, but is {intensity}.")
    if expected_m is not None and not 0 <= expected_m[0] < expected_m[1] < np.inf:
        raise DataError(
            f"`expected_m` must be a lower and a higher distance in m, but is {expected_m}."
        )


def _padded(observations: Observations, order: int, limits: TrackingThresholds):
    """Scans padded to a length that programs are compiled for; `real` tells them apart."""
    size, length = observations.size, limits.shortest_padding
    while length < size:
        length *= 2
    more = length - size
    step = np.pad(np.diff(observations.time_s, prepend=observations.time_s[0]), (0, more))
    gain = np.pad(observations.gains(order), ((0, more), (0, 0)), mode="edge")
    variance = np.pad(observations.stderr_m**2, (0, more), mode="edge")
    scans = _kalman.Scans(jnp.asarray(step), jnp.asarray(gain), jnp.asarray(variance))
    apparent = jnp.asarray(np.pad(observations.apparent_m, (0, more)))
    return scans, apparent, jnp.asarray(np.arange(length) < size)


def _prior(observations, order, expected_m, limits) -> Prior:
    """Before any scan: a distance within its range, a velocity of either direction."""
    high = max(2.0 * float(observations.apparent_m.max()), 1.0)
    low, high = (0.0, high) if expected_m is None else expected_m
    spread = ((high - low) / 2.0, limits.fastest, limits.acceleration_spread)[: order + 1]
    mean = np.zeros(order + 1)
    mean[0] = (low + high) / 2.0
    # Without a range given, only a distance below zero is ruled out.
    above = high if expected_m is not None else np.inf
    edges = jnp.asarray(float(low)), jnp.asarray(float(above))
    return Prior(jnp.asarray(mean), jnp.asarray(np.diag(np.square(spread))), *edges)


def _resolve(scans, apparent, real, prior, intensity, size, limits):
    """Signs at intensities far apart, the noise there, and the signs once more from near it."""
    first = _FIRST[0] if intensity is None else np.full(_FIRST[0].size, intensity)
    pairs = jnp.asarray(first), jnp.asarray(_FIRST[1])
    best = best_path(scans, apparent, real, *pairs, prior, size, limits)
    choice = _choice(apparent, best.sign, best.use, best, size, limits)
    noise = estimate_noise(scans, choice, (prior.mean, prior.cov), limits, intensity)
    near = noise.intensity * (_NEAR[0] if intensity is None else np.ones(_NEAR[0].size))
    pairs = jnp.asarray(near), jnp.asarray(noise.scale * _NEAR[1])
    again = best_path(scans, apparent, real, *pairs, prior, size, limits)
    return again._replace(log_odds=min(again.log_odds, best.log_odds)), noise


@dataclasses.dataclass(frozen=True, eq=False)
class _Verdict:
    """Of each scan, by the others: its sign, whether that is open, whether it is an outlier."""

    sign: np.ndarray
    open_sign: np.ndarray
    outlier: np.ndarray


def _judge(apparent, expected, spread, limits) -> _Verdict:
    """Judge each scan by what the others expect of it (`leave_one_out`)."""
    from scipy import special

    sign = np.where(expected < 0, -1, 1)
    # Odds of the two signs: normal densities at +-y about the expected value.
    open_sign = 2.0 * apparent * np.abs(expected) / spread < np.log(limits.fold_odds)
    gate = 2.0 * special.erfcinv(limits.gate) ** 2  # chi-square of one degree of freedom
    misfit = (sign * apparent - expected) ** 2 / spread
    # An outlier spoils its neighbours, so that they are judged once it is gone.
    around = np.lib.stride_tricks.sliding_window_view(np.pad(misfit, 2), 5).max(axis=1)
    return _Verdict(sign, open_sign, (misfit > gate) & (misfit == around))


def _choice(apparent, sign, use, best: Best, size, limits) -> _kalman.Choice:
    """Decisions as padded columns; motion is free across gated scans beside a change."""
    change = best.change.copy()
    silent = ~best.use
    for k in np.flatnonzero(best.change):  # the change may have come at any scan gated before it
        j = k - 1
        while j > 0 and silent[j]:
            change[j] = 1
            j -= 1
    j = size - 1
    while j > 0 and silent[j]:  # at the end: nothing later says whether the motion went on
        change[j] = 1
        j -= 1
    change[0] = 0
    more = (0, apparent.size - size)
    signed = apparent * jnp.asarray(np.pad(sign.astype(float), more))
    manoeuvre = np.pad(np.where(change > 0, limits.velocity_spread, 0.0), more)
    jump = np.pad(np.where(change == 2, limits.distance_spread, 0.0), more)
    return _kalman.Choice(
        signed, jnp.asarray(np.pad(use, more)), jnp.asarray(manoeuvre), jnp.asarray(jump)
    )


def _vibration(observations, use, scale, limits) -> float:
    """Velocity, m/s rms, that scatters scans by what their errors do not account for."""
    if scale <= limits.largest_scale:
        return 0.0
    share = observations.stderr_m[use] / np.abs(observations.doppler_gain_s[use])
    return float(scale * np.sqrt(np.mean(share[np.isfinite(share)] ** 2)))


def _notes(
    observations, use, folded, best: Best, odds, scale, vibration, limits
) -> tuple[str, ...]:
    """What a reader should know of this track, as sentences."""
    time, notes = observations.time_s, []
    if odds < limits.ambiguous_odds:
        notes.append(
            f"Another track fits nearly as well (odds {odds:.3g} to 1). Give the range of expected "
            "distances, or record more scans."
        )
    if folded.any():
        notes.append(
            f"{folded.sum()} scan(s) are left out, their apparent distance being too near zero to "
            f"tell its sign; the first at {time[np.argmax(folded)]:.6g} s."
        )
    outliers = ~use & ~folded
    if outliers.any():
        notes.append(
            f"{outliers.sum()} scan(s) are gated as outliers; the first at "
            f"{time[np.argmax(outliers)]:.6g} s."
        )
    for k in np.flatnonzero(best.change):
        what = "the target moved to another distance" if best.change[k] == 2 else "motion changed"
        notes.append(f"Before {time[k]:.6g} s {what}.")
    if not best.use[-1]:
        notes.append("The last scan does not fit: the motion may have changed there.")
    if vibration > 0.0:
        notes.append(
            f"Scans scatter by {scale:.3g} times their errors, as where the target vibrates with "
            f"{vibration:.3g} m/s rms: velocities are those of its mean motion, their errors hold "
            "its vibration too."
        )
    elif scale > 1.0:
        notes.append(f"The stated errors are too small; they were scaled by {scale:.3g}.")
    return tuple(notes)
