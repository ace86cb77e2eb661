"""Draws of a model's parameters: by Laplace's approximation, or of a posterior."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.identification._parameter_vector import ParameterVector
from fitting.identification._result import FitResult
from fitting.uncertainty._thresholds import THRESHOLDS
from rapi_jax import ECDL, ModelError
from rapi_jax.internal import takes


@dataclasses.dataclass(frozen=True, eq=False)
class ModelDraws:
    """Models that the data leave possible, as draws of their parameters.

    - `ecdl`: the model that was fitted, from whose drives and predictions bands are counted.
    - `values`: all declared parameters of it, in order of declaration; held ones are the same in
      all draws. `method`: "laplace" or "posterior".

    >>> from fitting import fit, laplace_draws
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> laplace_draws(result, draws=20).values.shape[0]
    20
    """

    ecdl: ECDL
    values: Float[np.ndarray, "draws parameters"]
    method: str

    @property
    def vector(self) -> ParameterVector:
        """Which column is which parameter."""
        return ParameterVector.of(self.ecdl)


@takes(result=FitResult)
def laplace_draws(result: FitResult, *, draws: int = 1000, seed: int = 0) -> ModelDraws:
    """Draws from the normal distribution of the fit's estimates (Laplace's approximation).

    Their covariance is that of the fit, corrected for correlated residuals. Draws outside the
    parameters' bounds are drawn again. Raises `ModelError` where the data do not fix a parameter,
    or hardly a draw lies within the bounds.

    >>> from fitting import fit, laplace_draws
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> draws = laplace_draws(result, draws=20, seed=1)
    >>> draws.method, draws.values.shape[0]
    ('laplace', 20)
    """
    vector = ParameterVector.of(result.ecdl)
    stderr = {p.name: p.stderr for p in result.parameters}
    known = [i for i, name in enumerate(result.names) if name in stderr]
    names = tuple(result.names[i] for i in known)
    correlation = result.correlation[np.ix_(known, known)]
    return draw_normal(
        result.ecdl, names, np.array([stderr[name] for name in names]), correlation, vector, draws,
        seed,
    )  # fmt: skip


def laplace_draws_of(
    ecdl: ECDL, table: dict[str, Any], *, draws: int = 1000, seed: int = 0
) -> ModelDraws:
    """The same from a model and the `model.json` beside it, as `json.load` gives that.

    Raises `ModelError` where the table is of another model, or as `laplace_draws`.
    """
    vector = ParameterVector.of(ecdl)
    try:
        parameters, joint = table["parameters"], table["correlation"]
        known = [i for i, name in enumerate(joint["names"]) if name in parameters]
        names = tuple(joint["names"][i] for i in known)
        stderr = np.array(
            [np.inf if (s := parameters[name]["stderr"]) is None else float(s) for name in names]
        )
        correlation = np.array(joint["matrix"], dtype=float)[np.ix_(known, known)]
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ModelError(
            "its model.json holds no standard errors with correlations. Fit it again."
        ) from error
    if set(parameters) != set(vector.names):
        raise ModelError("its model.json is of a model with other parameters. Fit it again.")
    return draw_normal(ecdl, names, stderr, correlation, vector, draws, seed)


@takes(result=FitResult)
def posterior_draws(
    result: FitResult, posterior: Any, *, draws: int = 1000, seed: int = 0
) -> ModelDraws:
    """`draws` of those in `posterior`, of `sample_posterior`, picked at random without replacement.

    All of them where there are fewer. Raises `ModelError` where it is of another fit.

    >>> from fitting import fit, posterior_draws, sample_posterior
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> posterior = sample_posterior(result, chains=2, draws=300, warmup=300, throw=False)
    >>> posterior_draws(result, posterior, draws=50).values.shape  # draws, parameters
    (50, 11)
    """
    vector = ParameterVector.of(result.ecdl)
    samples = posterior.posterior
    missing = [p.name for p in result.parameters if not p.held and p.name not in samples.data_vars]
    if missing:
        raise ModelError(
            f"the posterior does not hold {', '.join(missing)}: it is of another fit. Sample that "
            "of this one."
        )
    values = vector.values(result.ecdl)
    columns = [
        np.asarray(samples[p.name]).ravel() if not p.held else np.array(value)
        for p, value in zip(result.parameters, values, strict=True)
    ]
    every = np.stack(np.broadcast_arrays(*columns), axis=1)
    count = min(draws, every.shape[0])
    pick = np.random.default_rng(seed).choice(every.shape[0], count, replace=False)
    return ModelDraws(result.ecdl, every[pick], "posterior")


def draw_normal(
    ecdl: ECDL,
    names: tuple[str, ...],
    stderr: Float[np.ndarray, " fitted"],
    correlation: Float[np.ndarray, "fitted fitted"],
    vector: ParameterVector,
    draws: int,
    seed: int,
) -> ModelDraws:
    """Draws about the values of `ecdl`, within the bounds of its parameters."""
    if draws < 1:
        raise ValueError(f"Argument `draws` must be 1 or more, but is {draws}.")
    endless = [name for name, s in zip(names, stderr, strict=True) if not np.isfinite(s)]
    if endless:
        raise ModelError(
            f"the data do not fix {', '.join(endless)}, so a band would have no end. Hold what is "
            "not determined (`free=`), or record runs that tell it."
        )
    values = vector.values(ecdl)
    places = [vector.names.index(name) for name in names]
    low, high = np.array(vector.spread(lambda p: p.bounds))[places].T
    size, turn = np.linalg.eigh(correlation)
    root = stderr[:, None] * turn * np.sqrt(np.maximum(size, 0.0))
    rng = np.random.default_rng(seed)
    out, tried, kept = np.tile(values, (draws, 1)), 0, 0
    while kept < draws:
        some = values[places] + rng.standard_normal((draws, len(places))) @ root.T
        inside = some[((some >= low) & (some <= high)).all(axis=1)][: draws - kept]
        out[kept : kept + inside.shape[0], places] = inside
        kept, tried = kept + inside.shape[0], tried + draws
        if tried >= 1.0 / THRESHOLDS.rejected and kept < THRESHOLDS.rejected * tried:
            raise ModelError(
                "a parameter lies so near to a bound that hardly any draw from the errors of the "
                'fit is within it. In Python the argument `method="posterior"` draws from the '
                "posterior, which keeps to the bounds."
            )
    return ModelDraws(ecdl, out, "laplace")
