"""Process-noise intensity and a common scale of the errors, by maximum likelihood."""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from . import _kalman, _motion
from ._thresholds import TrackingThresholds

Start = tuple[_motion.State, _motion.Covariance]

# Coarse to fine, in decades of intensity and of scale; each refinement covers the last one's step.
_DECADES = (np.linspace(-20.0, 4.0, 25), np.linspace(-1.0, 1.0, 25), np.linspace(-0.1, 0.1, 25))
_SCALES = (np.linspace(0.0, 2.5, 11), np.linspace(-0.25, 0.25, 11), np.linspace(-0.05, 0.05, 11))
_HALF_CHI_SQUARE = 1.92  # of one parameter at 95 %


class Noise(NamedTuple):
    """Estimates: intensity, its 95 % interval by likelihood ratio, and the errors' scale."""

    intensity: float
    interval: tuple[float, float]
    scale: float


@functools.partial(jax.jit, static_argnames="acceleration")
def log_likelihoods(
    scans: _kalman.Scans,
    choice: _kalman.Choice,
    intensities: Float[Array, " grid"],
    scales: Float[Array, " grid"],
    start: Start,
    acceleration: float,
) -> Float[Array, " grid"]:
    """Log likelihood at each pair of an intensity and a scale of the errors."""

    def one(intensity, scale):
        scaled = scans._replace(variance=scans.variance * scale**2)
        noise, moves = _kalman.noise_of(scaled, choice, intensity, acceleration)
        filtered = _kalman.kalman_filter(scaled, choice, noise, moves, start)
        return _kalman.log_likelihood(filtered, choice.use)

    return jax.vmap(one)(intensities, scales)


def estimate_noise(
    scans: _kalman.Scans,
    choice: _kalman.Choice,
    start: Start,
    limits: TrackingThresholds,
    intensity: float | None = None,
) -> Noise:
    """The most likely intensity (unless given) and scale; the scale is 1 unless that is refuted."""
    decade = 0.0 if intensity is None else np.log10(intensity)
    best_at, one_at, scale_at = decade, decade, 0.0
    points: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # decades, best, at scale 1
    best = one = -np.inf
    for decades, scales in zip(_DECADES, _SCALES, strict=True):
        if intensity is not None:
            decades = np.zeros_like(decades)
        # The refined grid about the best scale, and a column at scale 1 about its own intensity.
        rows = np.repeat(decades + best_at, scales.size), np.tile(scales + scale_at, decades.size)
        plain = decades + one_at, np.zeros_like(decades)
        at, by = (np.concatenate(pair) for pair in zip(rows, plain, strict=True))
        by = np.maximum(by, 0.0)
        found = np.asarray(
            log_likelihoods(
                scans,
                choice,
                jnp.asarray(10.0**at),
                jnp.asarray(10.0**by),
                start,
                limits.acceleration_spread,
            )
        )
        alone = found[-decades.size :]
        grid = found[: -decades.size].reshape(decades.size, -1).max(axis=1)
        points += [(decades + best_at, grid, np.full(decades.size, -np.inf))]
        points += [(plain[0], alone, alone)]
        if alone.max() > one:
            one, one_at = alone.max(), plain[0][int(np.argmax(alone))]
        top = int(np.argmax(found))
        if found[top] > best:
            best, best_at, scale_at = found[top], at[top], by[top]
    scaled = bool(best - one > limits.scale_likelihood)
    peak = float(best if scaled else one)
    value = float(10.0 ** (best_at if scaled else one_at))
    interval = (value, value) if intensity is not None else _interval(points, scaled, peak)
    return Noise(value, interval, float(10.0**scale_at) if scaled else 1.0)


def _interval(points, scaled: bool, peak: float) -> tuple[float, float]:
    """Intensities whose log likelihood is within 1.92 of the peak; 0 where no lower end is seen."""
    decades, free, alone = (np.concatenate(column) for column in zip(*points, strict=True))
    values = free if scaled else alone
    order = np.lexsort((-values, decades))
    decades, values = decades[order], values[order]
    first = np.append(True, np.diff(decades) > 1e-9) & np.isfinite(values)
    decades, values = decades[first], values[first]
    fine = np.linspace(decades[0], decades[-1], 20001)
    inside = fine[np.interp(fine, decades, values) > peak - _HALF_CHI_SQUARE]
    low = 0.0 if inside[0] == fine[0] else float(10.0 ** inside[0])
    return low, float(10.0 ** inside[-1])
