"""`sample_posterior`: the posterior of a fit's parameters, by NUTS from the optimum."""

from typing import Any

import numpy as np

from fitting._versions import package_versions
from fitting.identification._result import FitResult
from fitting.uncertainty._fitted_problem import FittedProblem
from rapi_jax.internal import float64, takes

from ._convergence import UntrustedPosterior, failures, import_arviz
from ._nuts import run_chains
from ._pose import Posed


@takes(result=FitResult)
@float64
def sample_posterior(
    result: FitResult,
    *,
    chains: int = 4,
    draws: int = 1000,
    warmup: int = 500,
    seed: int = 0,
    throw: bool = True,
) -> Any:
    """Draws from the posterior of what `result` fitted, as ArviZ's `InferenceData`.

    Readings are normal about the model. The noise is that which the residuals hold (white noise and
    relaxations, run by run: `fitting.noise`) and counts as known. Priors are flat within the
    parameters' bounds; a posterior that stays flat to infinity has none, and shows as chains that
    do not converge. The polynomial, offsets and drift are integrated out and drawn exactly, the
    others by the no-U-turn sampler (M. D. Hoffman and A. Gelman, JMLR 15, 1593, 2014) in
    coordinates without bounds, whitened by their covariance at the optimum, where chains start.

    The posterior weighs readings by their noise, a fit by `weights`: where these differ, or noise
    is correlated, the posterior is narrower than the fit's standard errors, and its middle need not
    be the fit's value.

    **Arguments:**

    - `result`: of a fit with squares as its loss.
    - `chains`, `draws`: how many chains, and draws that are kept of each, after `warmup` draws of
      adaptation. `seed`: of all randomness.
    - `throw`: raise `UntrustedPosterior` unless R-hat < 1.01 and more than 400 effective draws in
      bulk and tails for each parameter, and no divergence.

    **Returns** groups `posterior` (one variable per parameter, offset, drift and initial fraction,
    with dimensions `chain` and `draw`) and `sample_stats`. Raises `ModelError` for a robust loss,
    for residuals without noise, or where the data do not fix a parameter; `ModuleNotFoundError`
    without the extra `bayes`.

    >>> from fitting import fit, sample_posterior
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> posterior = sample_posterior(result, chains=2, draws=300, warmup=300, throw=False)
    >>> drawn = posterior.posterior["lam"]
    >>> drawn.shape, round(float(drawn.mean()), 2)
    ((2, 300), 1.6)
    """
    least = {"chains": 1, "draws": max(4, chains), "warmup": 1}  # fewer tell nothing of chains
    for name, number in (("chains", chains), ("draws", draws), ("warmup", warmup)):
        if number < least[name]:
            raise ValueError(f"Argument `{name}` must be {least[name]} or more, but is {number}.")
    arviz = import_arviz()
    posed = Posed.of(FittedProblem.of(result))
    found = run_chains(posed.density, chains, draws, warmup, seed)
    normal = np.random.default_rng(seed).standard_normal((chains * draws, posed.places.size))
    values = posed.values(found.z.reshape(chains * draws, -1), normal)
    posterior = arviz.from_dict(
        posterior={
            name: column.reshape(chains, draws)
            for name, column in zip(posed.names, values.T, strict=True)
        },
        sample_stats={
            "diverging": found.diverging,
            "n_steps": found.steps,
            "acceptance_rate": found.acceptance,
            "lp": found.log_density,
        },
        attrs={
            "operator": type(result.ecdl.operator).__name__,
            "data_sha256": result.data_sha256 or result.recording.sha256(),
            "versions": ", ".join(f"{k} {v}" for k, v in package_versions().items()),
        },
    )
    reasons = failures(posterior)
    if throw and reasons:
        raise UntrustedPosterior(posterior, reasons)
    return posterior
