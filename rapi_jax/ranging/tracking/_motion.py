"""How a target moves between scans: white noise of acceleration, or of jerk."""

import jax.numpy as jnp
from jaxtyping import Array, Float

State = Float[Array, " state"]
Covariance = Float[Array, "state state"]


def transition(step: Float[Array, ""], order: int) -> Covariance:
    """The state (L, v) or (L, v, a) after `step` seconds, as a matrix."""
    one, zero = jnp.ones_like(step), jnp.zeros_like(step)
    if order == 1:
        return jnp.stack([jnp.stack([one, step]), jnp.stack([zero, one])])
    rows = ([one, step, step**2 / 2], [zero, one, step], [zero, zero, one])
    return jnp.stack([jnp.stack(row) for row in rows])


def process_noise(step: Float[Array, ""], order: int) -> Covariance:
    """Covariance gained over `step` seconds at unit intensity.

    White noise of acceleration (order 1, intensity in m^2/s^3) or of jerk (order 2, m^2/s^5):
    the integral of F(s) g g' F(s)' (Bar-Shalom, Li and Kirubarajan 2001, Section 6.2).
    """
    s = step
    if order == 1:
        return jnp.stack([jnp.stack([s**3 / 3, s**2 / 2]), jnp.stack([s**2 / 2, s])])
    rows = (
        [s**5 / 20, s**4 / 8, s**3 / 6],
        [s**4 / 8, s**3 / 3, s**2 / 2],
        [s**3 / 6, s**2 / 2, s],
    )
    return jnp.stack([jnp.stack(row) for row in rows])


def change_noise(
    step: Float[Array, ""],
    order: int,
    distance: Float[Array, ""],
    velocity: Float[Array, ""],
    acceleration: Float[Array, ""],
) -> Covariance:
    """Covariance gained where the motion changes within `step` seconds.

    Standard deviations: of a jump in distance (m); of a change of velocity (m/s) at any time
    within the step; of the acceleration after it (m/s^2, order 2).
    """
    along = jnp.array([step**2 / 3, step / 2, jnp.ones_like(step)])
    block = jnp.array([[along[0], along[1]], [along[1], along[2]]]) * velocity**2
    noise = jnp.zeros((order + 1, order + 1)).at[:2, :2].set(block)
    noise = noise.at[0, 0].add(distance**2)
    return noise if order == 1 else noise.at[2, 2].add(acceleration**2)
