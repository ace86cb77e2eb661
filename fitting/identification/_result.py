"""Result of a fit: the model, its parameters and errors by run, the verdict on it."""

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np

from rapi_jax import ECDL, Recording
from rapi_jax.internal import quantity

from ._content import model_content
from .assessment._claim import Claim
from .assessment._cross_validation import HeldOut, no_run_is_predicted
from .assessment._ends import Start, describe_starts
from .assessment._estimates import Estimate, RunFit
from .assessment._verdict import Verdict
from .data_checks._fault import Fault


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FitResult:
    """A fitted model and all that is needed to decide whether to use it.

    `predicted` holds the model's response to each run, `correlation` that of `names`, `effective`
    the number of independent samples the residuals are worth. `claim`: what to expect of data not
    seen. `loss`: the loss function. `recording` is what was fitted; `data_sha256`: hash of the
    whole recording, where only part of it was fitted. RMS values are in `recording.response_unit`;
    with a loss other than "squares" those of `held_out` and `claim` are of errors weighted as in
    the fit.

    >>> from fitting import fit
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> [estimate.name for estimate in result.parameters][:3], len(result.runs)
    (['alpha', 'zeta', 'lam'], 4)
    """

    ecdl: ECDL
    recording: Recording
    verdict: Verdict
    parameters: tuple[Estimate, ...]
    runs: tuple[RunFit, ...]
    rmse: float
    held_out: tuple[HeldOut, ...]
    starts: tuple[Start, ...]
    faults: tuple[Fault, ...]
    names: tuple[str, ...]
    correlation: np.ndarray
    effective: float
    predicted: tuple[np.ndarray, ...]
    used: tuple[np.ndarray, ...]
    seconds: float
    claim: Claim | None = None
    loss: str = "squares"
    data_sha256: str = ""

    def noting(self, note: str | None, given: Recording) -> "FitResult":
        """The result of a fit to a part of the recording `given`, and the note that says so."""
        if note is None:
            return self
        verdict = dataclasses.replace(self.verdict, notes=(note, *self.verdict.notes))
        return dataclasses.replace(self, verdict=verdict, data_sha256=given.sha256())

    @property
    def rmse_held_out(self) -> float:
        """RMSE on the last third, by a model fitted to the rest; NaN where not computed."""
        for scheme in self.held_out:
            if scheme.scheme == "last third":
                return scheme.rmse
        return float("nan")

    @property
    def predicts_no_run(self) -> bool:
        """Whether no run is predicted by a fit to all others, so that only its own are."""
        span = max(run.span for run in self.recording.runs)
        return self.claim is not None and no_run_is_predicted(self.held_out, self.claim.noise, span)

    @property
    def swings_joined(self) -> bool:
        """Whether each amplitude that was left out was predicted from the others."""
        noise = 0.0 if self.claim is None else self.claim.noise
        span = max(run.span for run in self.recording.runs)
        levels = np.array(self.recording.amplitudes)
        level = [int(np.abs(levels - run.drive.u_pp).argmin()) for run in self.recording.runs]

        def alone(rows: tuple[int, ...]) -> bool:
            """Whether no other run has an amplitude of these."""
            others = {level[k] for k in range(len(level)) if k not in rows}
            return bool(rows) and not others & {level[k] for k in rows}

        missed = [h.runs for h in self.held_out if h.large and h.exceeds(noise, span)]
        return not any(alone(rows) for rows in missed)

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of the parameter `name`."""
        for estimate in self.parameters:
            if estimate.name == name:
                return estimate
        raise KeyError(
            f"no parameter {name!r}; there are {', '.join(p.name for p in self.parameters)}"
        )

    def describe_starts(self) -> str:
        """How many starts there were, of which kind, and what their ends have in common."""
        return describe_starts(self.starts)

    def summary(self) -> str:
        """The result as text for people."""
        from fitting.report import render_text

        return render_text(self)

    def _repr_html_(self) -> str:
        from fitting.report import render_html

        return render_html(self)

    @property
    def plot(self) -> Any:
        """Pictures: `result.plot.loops()`, `.residuals()`, `.spectrum()`, `.correlation()`, ..."""
        from fitting.report.fit._plots import FitPlots

        return FitPlots(self)

    def to_dataframe(self) -> Any:
        """A pandas `DataFrame` with a row for each parameter: value, error, 95 % interval."""
        import pandas as pd

        rows = [
            {
                "value": p.value,
                "stderr": p.stderr,
                "low": p.interval()[0],
                "high": p.interval()[1],
                "unit": p.unit,
                "at_bound": p.at_bound,
                "held": p.held,
            }
            for p in self.parameters
        ]
        return pd.DataFrame(rows, index=pd.Index([p.name for p in self.parameters], name="name"))

    def to_dataset(self) -> Any:
        """The recording as an xarray `Dataset`, with `predicted`, and `used` (1 where fitted)."""
        from rapi_jax.internal import recording_dataset

        used = [used.astype(float) for used in self.used]
        return recording_dataset(self.recording, predicted=list(self.predicted), used=used)

    def __repr__(self) -> str:
        word = "trusted" if self.verdict.trusted else "not to be trusted"
        rmse = quantity(self.rmse, self.recording.response_unit)
        return f"<FitResult: {type(self.ecdl.operator).__name__}, {word}, rmse {rmse}>"

    def __str__(self) -> str:
        return self.summary()

    def save(self, folder: str | os.PathLike[str], *, plots: bool = True) -> list[Path]:
        """Write `model.json`, the loadable model and pictures to `folder`, for `rapi predict`."""
        from fitting.report import write_fit

        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        return write_fit(self, path, plots=plots)

    def to_dict(self) -> dict[str, Any]:
        """The result as in `model.json` (schema `rapi.model/1`); not finite becomes `None`."""
        return model_content(self)


class UntrustedFit(RuntimeError):
    """A fit that is not to be trusted; `result` holds it all the same.

    >>> from fitting import UntrustedFit, fit
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> try:
    ...     fit(paper_device(), recording, starts=1, hold_out=False)
    ... except UntrustedFit as error:
    ...     print(error.result.verdict.reasons[0].split(":")[0])
    one start only
    """

    def __init__(self, result: FitResult):
        reasons = "; ".join(result.verdict.reasons)
        super().__init__(
            f"the fit is not to be trusted: {reasons} (pass `throw=False` to look at it)"
        )
        self.result = result
