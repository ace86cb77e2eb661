"""Kalman filter and Rauch-Tung-Striebel smoother over irregular times, for signed observations."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from . import _motion


class Scans(NamedTuple):
    """Scans of one length, padded: what does not change while signs and noise are sought.

    - `step`: s since the scan before, 0 at the first. `gain`: rows h. `variance`: m^2.
    """

    step: Float[Array, " scans"]
    gain: Float[Array, "scans state"]
    variance: Float[Array, " scans"]

    @property
    def order(self) -> int:
        return self.gain.shape[1] - 1


class Choice(NamedTuple):
    """What is decided of each scan: signed distance, whether it counts, changes before it.

    `manoeuvre` and `jump` are standard deviations (m/s and m) of a change before the scan.
    """

    signed: Float[Array, " scans"]
    use: Bool[Array, " scans"]
    manoeuvre: Float[Array, " scans"]
    jump: Float[Array, " scans"]


class Filtered(NamedTuple):
    """Predicted and updated states, and innovations with their variances."""

    predicted: Float[Array, "scans state"]
    predicted_cov: Float[Array, "scans state state"]
    mean: Float[Array, "scans state"]
    cov: Float[Array, "scans state state"]
    innovation: Float[Array, " scans"]
    innovation_var: Float[Array, " scans"]


def joseph(
    mean: _motion.State,
    cov: _motion.Covariance,
    gain: _motion.State,
    innovation: Float[Array, ""],
    variance: Float[Array, ""],
) -> tuple[_motion.State, _motion.Covariance]:
    """Update by one observation; Joseph's form, which stays symmetric and positive."""
    along = cov @ gain
    k = along / (gain @ along + variance)
    keep = jnp.eye(mean.size) - jnp.outer(k, gain)
    new = keep @ cov @ keep.T + variance * jnp.outer(k, k)
    return mean + k * innovation, (new + new.T) / 2


def noise_of(scans: Scans, choice: Choice, intensity: Float[Array, ""], acceleration: float):
    """Covariance gained before each scan, and the transitions."""

    def one(step, manoeuvre, jump):
        accel = jnp.where(manoeuvre > 0, acceleration, 0.0)
        noise = intensity * _motion.process_noise(step, scans.order)
        return noise + _motion.change_noise(step, scans.order, jump, manoeuvre, accel)

    noise = jax.vmap(one)(scans.step, choice.manoeuvre, choice.jump)
    return noise, jax.vmap(lambda step: _motion.transition(step, scans.order))(scans.step)


def kalman_filter(
    scans: Scans,
    choice: Choice,
    noise: Float[Array, "scans state state"],
    moves: Float[Array, "scans state state"],
    start: tuple[_motion.State, _motion.Covariance],
) -> Filtered:
    """Forward in time from the state `start` before the first scan."""

    def one(carry, scan):
        (step_noise, move, gain, variance, signed, use) = scan
        mean, cov = move @ carry[0], move @ carry[1] @ move.T + step_noise
        innovation = signed - gain @ mean
        updated = joseph(mean, cov, gain, innovation, variance)
        new = (jnp.where(use, updated[0], mean), jnp.where(use, updated[1], cov))
        return new, Filtered(mean, cov, *new, innovation, gain @ cov @ gain + variance)

    columns = (noise, moves, scans.gain, scans.variance, choice.signed, choice.use)
    return jax.lax.scan(one, start, columns)[1]


def log_likelihood(filtered: Filtered, use: Bool[Array, " scans"]) -> Float[Array, ""]:
    """Log likelihood of the scans that count, from their innovations."""
    nis = filtered.innovation**2 / filtered.innovation_var
    each = -0.5 * (nis + jnp.log(2 * jnp.pi * filtered.innovation_var))
    return jnp.where(use, each, 0.0).sum()


def smooth(
    filtered: Filtered,
    noise: Float[Array, "scans state state"],
    moves: Float[Array, "scans state state"],
) -> tuple[Float[Array, "scans state"], Float[Array, "scans state state"]]:
    """Rauch-Tung-Striebel smoother: states given all scans.

    The covariance is formed as (I - C F) P (I - C F)' + C (P' + Q) C' with the smoother's gain C,
    P' that of the next scan: a sum, where the usual difference would lose digits after a jump.
    """

    def one(carry, scan):
        mean, cov, predicted, predicted_cov, step_noise, move = scan
        scale = 1.0 / jnp.sqrt(jnp.diagonal(predicted_cov))
        unit = predicted_cov * jnp.outer(scale, scale)
        back = jnp.linalg.solve(unit, scale[:, None] * (move @ cov)).T * scale[None, :]
        keep = jnp.eye(mean.size) - back @ move
        new_mean = mean + back @ (carry[0] - predicted)
        new = keep @ cov @ keep.T + back @ (carry[1] + step_noise) @ back.T
        new = (new_mean, (new + new.T) / 2)
        return new, new

    last = (filtered.mean[-1], filtered.cov[-1])
    following = (filtered.predicted[1:], filtered.predicted_cov[1:], noise[1:], moves[1:])
    columns = (filtered.mean[:-1], filtered.cov[:-1], *following)
    means, covs = jax.lax.scan(one, last, columns, reverse=True)[1]
    return (
        jnp.concatenate([means, last[0][None]]),
        jnp.concatenate([covs, last[1][None]]),
    )
