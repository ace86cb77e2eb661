"""Intervals of a fit's parameters from the command line: by which method, and as written."""

import dataclasses
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import CycloptsError

if TYPE_CHECKING:
    from fitting.identification._result import FitResult

Intervals = Literal["gauss-newton", "profile", "posterior"]
LEVEL = 0.95
POSTERIOR = "posterior.nc"


@dataclasses.dataclass(frozen=True)
class FoundIntervals:
    """`content`: as in `model.json`. `files`: written with it. `refused`: why there is none."""

    content: dict[str, Any]
    files: dict[str, bytes]
    refused: tuple[str, ...] = ()

    @property
    def table(self) -> dict[str, Any]:
        """The key of `model.json`; an open end becomes `None`."""
        from fitting._json import replace_nonfinite

        return {"intervals": replace_nonfinite(self.content)}

    @property
    def ends(self) -> dict[str, tuple[float, float]]:
        """Both ends for each parameter, by name."""
        found = self.content["parameters"]
        return {name: (one["low"], one["high"]) for name, one in found.items()}


def check_intervals(method: Intervals | None, loss: str) -> None:
    """Refuse what cannot be, before anything is fitted."""
    if method in ("profile", "posterior") and loss != "squares":
        raise CycloptsError(
            msg=f"--intervals {method} needs --loss squares: other losses are no likelihood.",
            command_chain=("fit",),
        )
    if method == "posterior":
        from fitting.uncertainty.posterior._convergence import import_arviz

        try:
            import_arviz()
        except ModuleNotFoundError as error:
            raise CycloptsError(
                msg=f"--intervals posterior: {error}", command_chain=("fit",)
            ) from (error)


def find_intervals(
    result: "FitResult", method: Intervals, report: Callable[[str], None] | None = None
) -> FoundIntervals:
    """The 95 % intervals of what was fitted; a refusal is an outcome, too."""
    from fitting.uncertainty.posterior._convergence import UntrustedPosterior
    from rapi_jax import ModelError

    if report is not None:
        report(f"intervals: {method}")
    about = {"method": method, "level": LEVEL}
    try:
        more, parameters, files = _METHODS[method](result)
    except UntrustedPosterior as error:
        reasons = error.reasons
    except ModelError as error:
        reasons = (str(error),)
    else:
        return FoundIntervals(about | more | {"parameters": parameters}, files)
    content = about | {"parameters": {}, "refused": list(reasons)}
    return FoundIntervals(content, {}, tuple(reasons))


def written_intervals(path: Path) -> tuple[dict[str, tuple[float, float]], list[str]]:
    """Both ends by name as a `model.json` has them, and why there are none."""
    from fitting.commands.shared._out import read_json

    content = read_json(path)["intervals"]
    ends = {}
    for name, one in content["parameters"].items():
        low, high = one["low"], one["high"]
        ends[name] = -_ENDLESS if low is None else low, _ENDLESS if high is None else high
    return ends, content.get("refused", [])


_ENDLESS = float("inf")
Found = tuple[dict[str, Any], dict[str, Any], dict[str, bytes]]


def _gauss_newton(result: "FitResult") -> Found:
    degrees = max(result.effective - len(result.names), 1.0)
    ends = {p.name: p.interval(LEVEL, degrees) for p in result.parameters if not p.held}
    parameters = {name: {"low": low, "high": high} for name, (low, high) in ends.items()}
    return {"degrees": degrees}, parameters, {}


def _profile(result: "FitResult") -> Found:
    from fitting.uncertainty._profile import profile_likelihood

    found = profile_likelihood(result, level=LEVEL)
    parameters = {
        name: {"low": one.low, "high": one.high, "at_bound": one.at_bound, "remark": one.remark}
        for name, one in found.items()
    }
    return {}, parameters, {}


def _posterior(result: "FitResult") -> Found:
    import numpy as np

    from fitting.uncertainty.posterior._sample import sample_posterior

    posterior = sample_posterior(result)
    draws = posterior.posterior
    shares = [(1.0 - LEVEL) / 2.0, 0.5, (1.0 + LEVEL) / 2.0]
    parameters = {}
    for p in result.parameters:
        if not p.held:
            low, median, high = (float(q) for q in np.quantile(draws[p.name], shares))
            parameters[p.name] = {"low": low, "median": median, "high": high}
    more = {"chains": draws.sizes["chain"], "draws": draws.sizes["draw"], "file": POSTERIOR}
    return more, parameters, {POSTERIOR: _netcdf(posterior)}


_METHODS: dict[str, Callable[["FitResult"], Found]] = {
    "gauss-newton": _gauss_newton,
    "profile": _profile,
    "posterior": _posterior,
}


def _netcdf(posterior: Any) -> bytes:
    """The bytes of ArviZ's netCDF file, so that it can be written whole or not at all."""
    handle, name = tempfile.mkstemp(suffix=".nc")
    os.close(handle)
    path = Path(name)
    try:
        posterior.to_netcdf(str(path), engine="h5netcdf")
        return path.read_bytes()
    finally:
        path.unlink(missing_ok=True)
