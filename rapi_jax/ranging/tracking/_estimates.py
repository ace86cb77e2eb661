"""Smoothed states of chosen signs and noise, and what the other scans say of each scan."""

import functools

import jax
import jax.numpy as jnp
import numpy as np

from . import _kalman
from ._hypotheses import Prior
from ._likelihood import Noise, Start
from ._thresholds import TrackingThresholds


def first_state(
    scans: _kalman.Scans,
    choice: _kalman.Choice,
    prior: Prior,
    noise: Noise,
    limits: TrackingThresholds,
) -> Start:
    """The first state from all scans, with so wide a covariance that it says nothing of its own.

    A filter backwards in time gives it. A prior as wide as the range itself would cost the smoother
    its digits: 10 m beside 10 um are twelve decades of variance. Beside 0.1 um they are sixteen, so
    the first state is first found from errors that are not so small.
    """
    values = jnp.asarray(noise.intensity), jnp.asarray(noise.scale)
    coarse = floored(scans, prior, limits)
    start = _backwards(coarse, choice, (prior.mean, prior.cov), *values, limits=limits)
    if bool((coarse.variance == scans.variance).all()):
        return start
    return _backwards(scans, choice, start, *values, limits=limits)


def floored(scans: _kalman.Scans, prior: Prior, limits: TrackingThresholds) -> _kalman.Scans:
    """Scans with errors that the prior leaves digits for."""
    wide = jnp.einsum("ki,ij,kj->k", scans.gain, prior.cov, scans.gain).max()
    return scans._replace(variance=jnp.maximum(scans.variance, limits.finest * wide))


def smoothed_states(
    scans: _kalman.Scans,
    choice: _kalman.Choice,
    start: Start,
    noise: Noise,
    limits: TrackingThresholds,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means, covariances and normalised innovations squared, a scan each (padded)."""
    values = jnp.asarray(noise.intensity), jnp.asarray(noise.scale)
    return jax.device_get(_smoothed(scans, choice, start, *values, limits=limits))


def leave_one_out(
    scans: _kalman.Scans,
    choice: _kalman.Choice,
    mean: np.ndarray,
    cov: np.ndarray,
    scale: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Signed apparent distance of each scan by the others alone, m, and its variance with errors.

    For a scan that counted, from its smoothed residual e and variance c = h P h':
    e R / (R - c) and R^2 / (R - c).
    """
    gain, error = np.asarray(scans.gain), np.asarray(scans.variance) * scale**2
    signed, use = np.asarray(choice.signed), np.asarray(choice.use)
    fitted = np.einsum("ki,ki->k", gain, mean)
    known = np.einsum("ki,kij,kj->k", gain, cov, gain)
    free = np.maximum(1.0 - known / error, 1e-9)  # share of the scan that the others check
    expected = np.where(use, signed - (signed - fitted) / free, fitted)
    return expected, np.where(use, error / free, known + error)


@functools.partial(jax.jit, static_argnames="limits")
def _smoothed(scans, choice, start, intensity, scale, *, limits):
    scaled = scans._replace(variance=scans.variance * scale**2)
    noise, moves = _kalman.noise_of(scaled, choice, intensity, limits.acceleration_spread)
    filtered = _kalman.kalman_filter(scaled, choice, noise, moves, start)
    mean, cov = _kalman.smooth(filtered, noise, moves)
    return mean, cov, filtered.innovation**2 / filtered.innovation_var


@functools.partial(jax.jit, static_argnames="limits")
def _backwards(scans, choice, prior, intensity, scale, *, limits):
    scaled = scans._replace(variance=scans.variance * scale**2)
    noise, moves = _kalman.noise_of(scaled, choice, intensity, limits.acceleration_spread)
    back = jnp.linalg.inv(moves)
    noise = back @ noise @ jnp.swapaxes(back, 1, 2)
    # Before scan k in reversed time comes the step between k and k + 1.
    turned = jax.tree.map(lambda x: x[::-1], (scaled, choice))
    rolled = (jnp.roll(noise[::-1], 1, axis=0), jnp.roll(back[::-1], 1, axis=0))
    rolled = (rolled[0].at[0].set(0.0), rolled[1].at[0].set(jnp.eye(back.shape[1])))
    filtered = _kalman.kalman_filter(turned[0], turned[1], rolled[0], rolled[1], prior)
    return filtered.mean[-1], limits.inflation * filtered.cov[-1]
