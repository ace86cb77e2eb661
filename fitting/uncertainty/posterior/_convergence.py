"""Whether chains may be trusted: R-hat, effective draws, divergences."""

from typing import Any

import numpy as np

from fitting.uncertainty._thresholds import THRESHOLDS


class UntrustedPosterior(RuntimeError):
    """Chains that did not converge; `posterior` holds them all the same, `reasons` says why.

    >>> from fitting import UntrustedPosterior
    >>> error = UntrustedPosterior(None, ("R-hat of alpha is 1.2",))
    >>> error.reasons
    ('R-hat of alpha is 1.2',)
    """

    def __init__(self, posterior: Any, reasons: tuple[str, ...]):
        super().__init__(
            f"the posterior is not to be trusted: {'; '.join(reasons)} (pass `throw=False` to look "
            "at it)"
        )
        self.posterior = posterior
        self.reasons = reasons


def failures(posterior: Any) -> tuple[str, ...]:
    """What speaks against chains, with a likely cause and what to do; empty where nothing does.

    `posterior`: ArviZ's `InferenceData`. Rank-normalised split R-hat, effective draws in bulk and
    tails (A. Vehtari et al., Bayesian Analysis 16, 667, 2021), and divergent transitions.
    """
    arviz = import_arviz()
    draws = posterior.posterior
    found = []
    count = int(np.asarray(posterior.sample_stats["diverging"]).sum())
    if count > THRESHOLDS.divergences:
        found.append(
            f"{count} divergent transitions: parts of the posterior are too narrow to be reached, "
            "as where parameters trade against each other or stand at a bound. Hold one of them, "
            "or record what tells them apart"
        )
    rhat = _numbers(arviz.rhat(draws))
    names = [name for name, value in rhat.items() if not value < THRESHOLDS.rhat]
    if names:
        worst = max(names, key=lambda name: np.nan_to_num(rhat[name], nan=np.inf))
        found.append(
            f"R-hat of {', '.join(names)} is not below {THRESHOLDS.rhat:g} (at most "
            f"{rhat[worst]:.3f}): chains disagree, as with several optima or too short a warm-up. "
            "Ask for more `draws`, or fit with more starts"
        )
    for method in ("bulk", "tail"):
        size = _numbers(arviz.ess(draws, method=method))
        names = [name for name, value in size.items() if not value > THRESHOLDS.effective_draws]
        if names:
            least = min(size[name] for name in names)
            found.append(
                f"the {method} of {', '.join(names)} is worth {least:.0f} independent draws, not "
                f"more than {THRESHOLDS.effective_draws:g}. Ask for more `draws`"
            )
    return tuple(found)


def _numbers(dataset: Any) -> dict[str, float]:
    return {str(name): float(value) for name, value in dataset.data_vars.items()}


def import_arviz() -> Any:
    """ArviZ, without what it says on import of versions to come.

    Raises `ModuleNotFoundError` with the cure where it is not installed.
    """
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        try:
            import arviz
            import numpyro  # noqa: F401 (both are wanted before any work is done)
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                f"a posterior needs the extra `bayes` ({error.name} is missing): install "
                "`rapi-jax[bayes]`."
            ) from error
    return arviz
