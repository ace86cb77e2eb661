"""Signs of scans, outliers and changes of motion, by several hypotheses followed side by side.

Each hypothesis is a Kalman filter with a log likelihood. At a scan it has seven children: either
sign with the motion unchanged, after a manoeuvre, or after a jump of the target; or the scan says
nothing. The most likely are kept, of those that decided the last few scans alike only the best
(D. B. Reid, IEEE Trans. Autom. Control 24, 843 (1979)).
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from . import _kalman, _motion
from ._thresholds import TrackingThresholds

_CHILDREN = 7  # (+, -) x (steady, manoeuvre, jump), outlier
_OUTLIER = 6
_NEVER = -1e9  # log likelihood of what is ruled out


class Prior(NamedTuple):
    """What is known beforehand: first state, its covariance, and where distances may lie, m."""

    mean: _motion.State
    cov: _motion.Covariance
    low: Float[Array, ""]
    high: Float[Array, ""]


class Best(NamedTuple):
    """The most likely path: sign, change before (1 manoeuvre, 2 jump), whether each scan counts.

    - `log_likelihood`, `log_odds`: of the path, and over the best of those that end elsewhere.
    """

    sign: np.ndarray
    change: np.ndarray
    use: np.ndarray
    log_likelihood: float
    log_odds: float


def best_path(
    scans: _kalman.Scans,
    apparent: Float[Array, " scans"],
    real: Bool[Array, " scans"],
    intensities: Float[Array, " several"],
    scales: Float[Array, " several"],
    prior: Prior,
    size: int,
    limits: TrackingThresholds,
) -> Best:
    """Follow hypotheses at several pairs of process noise and scale of errors; the best of all."""
    followed = jax.device_get(_follow(scans, apparent, real, intensities, scales, prior, limits))
    parents, children, score, mean, cov = followed
    weight = score.reshape(-1)
    top = int(np.argmax(weight))
    lane, last = divmod(top, score.shape[1])
    path = np.empty(size, dtype=int)
    at = last
    for k in range(size - 1, -1, -1):
        path[k] = children[lane, k, at]
        at = parents[lane, k, at]
    states, spreads = mean.reshape(-1, mean.shape[-1]), cov.reshape(-1, *cov.shape[-2:])
    # Rounding may leave a variance just below zero, beside a prior of many metres squared.
    variance = np.maximum(np.diagonal(spreads, axis1=1, axis2=2)[:, :2], 0.0)
    apart = np.abs(states[:, :2] - states[top, :2])
    other = (apart > limits.same_state * np.sqrt(variance + variance[top])).any(axis=1)
    rival = weight[other].max() if other.any() else -np.inf
    sign = np.where(path == _OUTLIER, 1, 1 - 2 * (path % 2))
    change = np.where(path == _OUTLIER, 0, path // 2)
    change, use = _drop_short(change, path != _OUTLIER, limits.shortest_stretch)
    return Best(
        sign=sign,
        change=change,
        use=use,
        log_likelihood=float(weight[top]),
        log_odds=float(weight[top] - rival),
    )


def _drop_short(
    change: np.ndarray, use: np.ndarray, shortest: int
) -> tuple[np.ndarray, np.ndarray]:
    """Scans between two changes count where there are enough of them to check each other.

    While a stage speeds up, any two scans fit a velocity of their own. Such a stretch is part of
    the change after it.
    """
    change, use = change.copy(), use.copy()
    edges = [0, *np.flatnonzero(change), change.size]
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        if len(edges) > 2 and use[begin:end].sum() < shortest:
            use[begin:end] = False
            if end < change.size:
                change[end] = max(change[begin], change[end])
            change[begin] = 0
    return change, use


@functools.partial(jax.jit, static_argnames="limits")
def _follow(scans, apparent, real, intensities, scales, prior, limits):
    """Over the pairs: parents and children a scan, and the hypotheses at the end."""
    one = functools.partial(_follow_one, limits=limits)
    return jax.vmap(one, in_axes=(None, None, None, 0, 0, None))(
        scans, apparent, real, intensities, scales, prior
    )


def _follow_one(scans, apparent, real, intensity, scale, prior, *, limits):
    kept, order = limits.hypotheses, scans.order
    spacing = jnp.log(jnp.maximum(apparent.max(), 1.0))
    log_outlier = jnp.log(limits.outlier) - spacing
    log_mode = jnp.log(jnp.array([1.0 - limits.outlier, limits.manoeuvre, limits.jump]))
    signs = jnp.array([1.0, -1.0])

    def extra(step):
        change = functools.partial(
            _motion.change_noise,
            step,
            order,
            velocity=jnp.asarray(limits.velocity_spread),
            acceleration=jnp.asarray(limits.acceleration_spread),
        )
        manoeuvre = change(jnp.asarray(0.0))
        jump = change(jnp.asarray(limits.distance_spread))
        return jnp.stack([jnp.zeros_like(jump), manoeuvre, jump])

    def advance(carry, scan):
        mean, cov, score, code = carry
        step, gain, variance, value, counts, first = scan
        move = _motion.transition(step, order)
        mean = mean @ move.T
        drift = intensity * _motion.process_noise(step, order)
        steady = move @ cov @ move.T + drift[None]
        covs = steady[:, None] + extra(step)[None]  # hypotheses modes state state
        spread = jnp.einsum("i,hmij,j->hm", gain, covs, gain) + variance
        error = signs[None, None, :] * value - (mean @ gain)[:, None, None]
        fit = -0.5 * (error**2 / spread[..., None] + jnp.log(2 * jnp.pi * spread)[..., None])
        modes = jnp.where(first & (jnp.arange(3) > 0), _NEVER, log_mode)
        fit = fit + modes[None, :, None]
        gone = jnp.full((mean.shape[0], 1), log_outlier)
        ranked = score[:, None] + jnp.concatenate([fit.reshape(mean.shape[0], 6), gone], axis=1)
        _, index = jax.lax.top_k(ranked.reshape(-1), 2 * kept)
        total = ranked.reshape(-1)[index]
        parent, child = index // _CHILDREN, index % _CHILDREN
        history = (code[parent] * _CHILDREN + child) % _CHILDREN**limits.memory
        same = jnp.tril(history[:, None] == history[None, :], k=-1).any(axis=1)
        total = jnp.where(same, total + _NEVER, total)
        total, pick = jax.lax.top_k(total, kept)
        parent, child, history = parent[pick], child[pick], history[pick]
        mode = jnp.where(child == _OUTLIER, 0, child // 2)
        chosen_mean, chosen_cov = mean[parent], covs[parent, mode]
        innovation = signs[child % 2] * value - chosen_mean @ gain
        updated = jax.vmap(_kalman.joseph, in_axes=(0, 0, None, 0, None))(
            chosen_mean, chosen_cov, gain, innovation, variance
        )
        silent = child == _OUTLIER
        new_mean = jnp.where(silent[:, None], chosen_mean, updated[0])
        new_cov = jnp.where(silent[:, None, None], chosen_cov, updated[1])
        slack = limits.range_errors * jnp.sqrt(new_cov[:, 0, 0])
        outside = (new_mean[:, 0] < prior.low - slack) | (new_mean[:, 0] > prior.high + slack)
        total = jnp.where(outside, total + _NEVER, total)
        new = (new_mean, new_cov, total, history)
        new = jax.tree.map(lambda a, b: jnp.where(counts, a, b), new, carry)
        same_parent = jnp.arange(kept, dtype=jnp.int32)
        return new, (jnp.where(counts, parent, same_parent), child)

    # One hypothesis to begin with; the others are ruled out until it has children.
    start = (
        jnp.tile(prior.mean, (kept, 1)),
        jnp.tile(prior.cov, (kept, 1, 1)),
        jnp.where(jnp.arange(kept) == 0, 0.0, _NEVER),
        jnp.arange(kept, dtype=jnp.int32),
    )
    first = jnp.arange(apparent.size) == 0
    columns = (scans.step, scans.gain, scans.variance * scale**2, apparent, real, first)
    (mean, cov, score, _), (parents, children) = jax.lax.scan(advance, start, columns)
    return parents, children, score, mean, cov
