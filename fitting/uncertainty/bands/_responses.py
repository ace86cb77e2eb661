"""Responses of many models to one drive, and which draws they are of."""

from typing import Any, Literal

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from fitting.identification._parameter_vector import ParameterVector, as_device
from fitting.identification._result import FitResult
from rapi_jax import ECDL, Drive, Recording, Run
from rapi_jax.internal import DriveBatch, respond, to_batch

from ._draws import ModelDraws, laplace_draws, posterior_draws

Method = Literal["laplace", "posterior"]


def draws_of(
    source: FitResult | ModelDraws, method: str, posterior: Any, draws: int, seed: int
) -> ModelDraws:
    """The draws to take a band from; those of a fit are made by `method`."""
    if isinstance(source, ModelDraws):
        return source
    if method == "laplace":
        return laplace_draws(source, draws=draws, seed=seed)
    if method != "posterior":
        raise ValueError(f'Argument `method` must be "laplace" or "posterior", not {method!r}.')
    if posterior is None:
        from fitting.uncertainty.posterior._sample import sample_posterior

        posterior = sample_posterior(source, seed=seed)
    return posterior_draws(source, posterior, draws=draws, seed=seed)


def responses(
    models: ModelDraws, drive: Drive
) -> tuple[Float[np.ndarray, "draws time"], Float[np.ndarray, " time"]]:
    """The steady responses to `drive` of each draw, and of the fitted model; 64 bits on."""
    run = Run(drive, np.zeros(drive.size))
    batch = to_batch(Recording((run,)), lead=bool(models.ecdl.effects))
    vector = models.vector
    values = np.concatenate([vector.values(models.ecdl)[None], models.values])
    found = np.asarray(_respond_to_each(models.ecdl, vector, as_device(values), batch.device()))
    inside = batch.sample[0] >= 0
    at_samples = found[:, inside][:, : drive.size]
    return at_samples[1:], at_samples[0]


@eqx.filter_jit
def _respond_to_each(
    ecdl: ECDL,
    vector: ParameterVector,
    values: Float[Array, "models parameters"],
    drive: DriveBatch,
) -> Float[Array, "models time"]:
    return jax.lax.map(lambda one: respond(vector.put(ecdl, one), drive)[0], values)


def interval(values: Float[np.ndarray, " draws"], level: float) -> tuple[float, float]:
    """The central interval of draws at `level`."""
    low, high = np.quantile(values, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    return float(low), float(high)


def check_level(level: float) -> None:
    """`ValueError` unless it is a share."""
    if not 0.0 < level < 1.0:
        raise ValueError(f"Argument `level` must lie between 0 and 1, but is {level}.")
