"""How far a compensated scan may be off a straight line, for certificates."""

import json
from pathlib import Path
from typing import Any

DRAWS = 200  # the ends of a 95 % interval are then those of 92 to 98 %


def scan_bands(model: Path, ecdl: Any, made: list[Any]) -> tuple[list[Any], str | None]:
    """A band for each drive in `made`, `None` where there is none; and a note that says why.

    `model`: as given on the command line. Standard errors are read from the `model.json` there,
    which names the model's own file; without one there is no band. So is the error of the model in
    runs that were left out, its claim: without one the bands are those of standard errors alone.
    """
    from fitting.report import MODEL, TABLE
    from fitting.uncertainty.bands._draws import laplace_draws_of
    from fitting.uncertainty.bands._nonlinearity import nonlinearity_band
    from rapi_jax import DataError, ModelError

    none: list[Any] = [None] * len(made)
    path = (model if model.is_dir() else model.parent) / TABLE
    if not path.is_file():
        return none, None
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(table, dict) or MODEL not in (table.get("files") or {}):
            return none, None
        draws = laplace_draws_of(ecdl, table, draws=DRAWS)
        misfit = _held_out_error(table.get("claim"))
        return [nonlinearity_band(draws, one, misfit=misfit).to_dict() for one in made], None
    except (ModelError, DataError, OSError, ValueError, RecursionError) as error:
        return none, f"no band on the nonlinearity: {error}"


def _held_out_error(claim: Any) -> float:
    """The rms error beyond noise in runs that were left out; 0 where none were, or it is noise."""
    if not isinstance(claim, dict):
        return 0.0
    return max(float(claim["rms"]) ** 2 - float(claim["noise"]) ** 2, 0.0) ** 0.5
