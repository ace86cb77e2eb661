"""Where a track begins: scans padded, a prior, and signs at intensities of noise far apart."""

import jax.numpy as jnp
import numpy as np

from . import _kalman
from ._decisions import to_choice
from ._hypotheses import Prior, best_path
from ._likelihood import estimate_noise
from ._observations import Observations
from ._thresholds import TrackingThresholds

# Pairs of intensity and scale at which signs are sought: far apart at first, then about the best.
_FIRST = (
    10.0 ** np.concatenate([np.linspace(-18.0, -2.0, 9), np.tile([-18.0, -12.0, -8.0], 3)]),
    10.0 ** np.concatenate([np.zeros(9), np.repeat([1.0, 2.0, 3.0], 3)]),
)
_NEAR = 10.0 ** np.tile(np.linspace(-1.0, 1.0, 9), 2), 2.0 ** np.repeat([0.0, 1.0], 9)


def pad_scans(observations: Observations, order: int, limits: TrackingThresholds):
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


def prior_of(observations, order, expected_m, limits) -> Prior:
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


def resolve_signs(scans, apparent, real, prior, intensity, size, limits):
    """Signs at intensities far apart, the noise there, and the signs once more from near it."""
    first = _FIRST[0] if intensity is None else np.full(_FIRST[0].size, intensity)
    pairs = jnp.asarray(first), jnp.asarray(_FIRST[1])
    best = best_path(scans, apparent, real, *pairs, prior, size, limits)
    choice = to_choice(apparent, best.sign, best.use, best, size, limits)
    noise = estimate_noise(scans, choice, (prior.mean, prior.cov), limits, intensity)
    near = noise.intensity * (_NEAR[0] if intensity is None else np.ones(_NEAR[0].size))
    pairs = jnp.asarray(near), jnp.asarray(noise.scale * _NEAR[1])
    again = best_path(scans, apparent, real, *pairs, prior, size, limits)
    return again._replace(log_odds=min(again.log_odds, best.log_odds)), noise
