"""The pictures of a fit, by name: `result.plot.loops()`."""

import dataclasses
from typing import Any

import numpy as np


@dataclasses.dataclass(frozen=True)
class FitPlots:
    """Each method returns a figure; `ax` draws into axes of yours, `run` shows one run alone.

    `result`: a `FitResult`. Figures are written by `rapi_jax.plot.png` and `svg`, or `savefig`.
    """

    result: Any

    def loops(self, *, run: int | None = None, ax: Any = None) -> Any:
        """Hysteresis loops less a straight line, measured and modelled."""
        from rapi_jax import plot

        return plot.loops(self.result.recording, self.result.predicted, run=run, ax=ax)

    def residuals(self, *, run: int | None = None, ax: Any = None) -> Any:
        """What the model leaves over the scan phase, up and down branches apart."""
        from rapi_jax import plot

        one = self.result
        return plot.residuals(one.recording, one.predicted, one.used, run=run, ax=ax)

    def spectrum(self, *, ax: Any = None) -> Any:
        """Amplitude spectral density of what the model leaves of each run."""
        from rapi_jax import plot

        one = self.result
        return plot.spectrum(one.recording, one.predicted, one.used, ax=ax)

    def correlation(self, *, ax: Any = None) -> Any:
        """Correlation of the parameters' errors, without a drift that was fitted beside them."""
        from rapi_jax import plot

        listed = {p.name for p in self.result.parameters}
        at = [i for i, name in enumerate(self.result.names) if name in listed]
        names = [self.result.names[i] for i in at]
        return plot.correlation(names, self.result.correlation[np.ix_(at, at)], ax=ax)

    def starts(self, *, ax: Any = None) -> Any:
        """Cost against solver steps of each start."""
        from rapi_jax import plot

        traces = [(start.origin, start.trace, start.agrees) for start in self.result.starts]
        return plot.convergence(traces, ax=ax)
