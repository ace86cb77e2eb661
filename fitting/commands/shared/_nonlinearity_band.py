"""How far standard errors let a compensated scan be off a straight line, for certificates."""

import json
from pathlib import Path
from typing import Any

DRAWS = 200  # the ends of a 95 % interval are then those of 92 to 98 %


def scan_bands(model: Path, ecdl: Any, made: list[Any]) -> tuple[list[Any], str | None]:
    """A band for each drive in `made`, `None` where there is none; and a note that says why.

    `model`: as given on the command line. Standard errors are read from the `model.json` there,
    which names the model's own file; without one there is no band.
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
        return [nonlinearity_band(draws, one).to_dict() for one in made], None
    except (ModelError, DataError, OSError, ValueError, RecursionError) as error:
        return none, f"no band on the nonlinearity: {error}"
