"""Track a target: signs by hypotheses, noise by likelihood, then filter and smoother."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int

from rapi_jax._errors import DataError
from rapi_jax._precision import float64

from ._decisions import judge_scans, to_choice
from ._estimates import first_state, floored, leave_one_out, smoothed_states
from ._first_signs import pad_scans, prior_of, resolve_signs
from ._likelihood import estimate_noise
from ._notes import describe_track
from ._observations import Observations
from ._thresholds import THRESHOLDS

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
    scans, apparent, real = pad_scans(observations, order, limits)
    prior = prior_of(observations, order, expected_m, limits)
    coarse = floored(scans, prior, limits)
    best, noise = resolve_signs(coarse, apparent, real, prior, intensity, size, limits)
    use, sign, folded = best.use.copy(), best.sign.copy(), np.zeros(size, dtype=bool)
    for number in range(_ROUNDS):
        choice = to_choice(apparent, sign, use, best, size, limits)
        start = first_state(scans, choice, prior, noise, limits)
        noise = estimate_noise(scans, choice, start, limits, intensity)
        mean, cov, nis = smoothed_states(scans, choice, start, noise, limits)
        expected, spread = leave_one_out(scans, choice, mean, cov, noise.scale)
        verdict = judge_scans(observations.apparent_m, expected[:size], spread[:size], limits)
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
        notes=describe_track(observations, use, folded, best, odds, noise.scale, vibration, limits),
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


def _vibration(observations, use, scale, limits) -> float:
    """Velocity, m/s rms, that scatters scans by what their errors do not account for."""
    if scale <= limits.largest_scale:
        return 0.0
    share = observations.stderr_m[use] / np.abs(observations.doppler_gain_s[use])
    return float(scale * np.sqrt(np.mean(share[np.isfinite(share)] ** 2)))
