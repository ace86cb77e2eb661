"""Chains of the no-U-turn sampler, by numpyro, one compiled program for each shape of a problem."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.uncertainty._thresholds import THRESHOLDS

from ._log_density import LogDensity


@dataclasses.dataclass(frozen=True, eq=False)
class Chains:
    """Draws in whitened coordinates, and how each was made."""

    z: Float[Array, "chains draws moved"]
    diverging: Bool[np.ndarray, "chains draws"]
    steps: Int[np.ndarray, "chains draws"]
    acceptance: Float[np.ndarray, "chains draws"]
    log_density: Float[np.ndarray, "chains draws"]


def run_chains(density: LogDensity, chains: int, draws: int, warmup: int, seed: int) -> Chains:
    """Chains that start beside the optimum, each adapted over `warmup` draws that are dropped.

    They run one after the other: side by side all wait for the longest trajectory.
    """
    start, key = jax.random.split(jax.random.key(seed))
    spread = THRESHOLDS.start_spread
    begins = spread * jax.random.normal(start, (chains, density.moves.size), dtype=np.float64)
    if not density.moves.size:  # all is linear
        none = np.zeros((chains, draws))
        return Chains(
            begins[:, None, :].repeat(draws, axis=1), none.astype(bool), none.astype(int), none + 1,
            none,
        )  # fmt: skip
    # numpyro's own arithmetic mixes integers and numbers, and broadcasts.
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        z, *how = _run(density, begins, jax.random.split(key, chains), draws, warmup)
    return Chains(z, *(np.asarray(x) for x in how))


@eqx.filter_jit
def _run(
    density: LogDensity, begins: Array, keys: Array, draws: int, warmup: int
) -> tuple[Array, ...]:
    from numpyro.infer.hmc import hmc

    def potential(density: LogDensity) -> Any:
        return lambda z: -density(z)

    def chain(arguments: tuple[Array, Array]) -> tuple[Array, ...]:
        begin, key = arguments
        initial, sample = hmc(potential_fn_gen=potential, algo="NUTS")
        state = initial(
            begin, num_warmup=warmup, target_accept_prob=THRESHOLDS.accept, dense_mass=True,
            model_args=(density,), rng_key=key,
        )  # fmt: skip

        def step(state: Any, _: None) -> tuple[Any, tuple[Array, ...]]:
            new = sample(state, model_args=(density,))
            return new, (
                new.z,
                new.diverging,
                new.num_steps,
                new.accept_prob,
                -new.potential_energy,
            )

        # One loop for both: the sampler, which compiles slowly, stands in the program once.
        made = jax.lax.scan(step, state, None, warmup + draws)[1]
        return jax.tree_util.tree_map(lambda x: x[warmup:], made)

    return jax.lax.map(chain, (begins, keys))
