"""The files of a population: JSON for machines, a picture for people."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting._json import json_text
from fitting._result_files import begin_result, list_files
from fitting.report.fit._files import save_figure
from rapi_jax.io import write_atomic

if TYPE_CHECKING:
    from fitting.population._change import Change
    from fitting.population._population import Population

POPULATION, PICTURE = "population.json", "population.png"


def write_population(
    population: "Population",
    folder: Path,
    *,
    change: "Change | None" = None,
    plots: bool = True,
    more: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Write the picture and, last, `population.json`; return their paths.

    `change`: of a new recording, in the file's `change`, which is null without one. `more`: further
    keys of it.
    """
    names = [PICTURE] if plots else []
    earlier = begin_result(folder, POPULATION, names)
    if plots:
        from rapi_jax import plot

        save_figure(plot.population(population, change), folder / PICTURE)
    written = [folder / name for name in names]
    content = population.to_dict()
    content["change"] = None if change is None else change.to_dict()
    files = list_files(written, earlier)
    write_atomic(folder / POPULATION, json_text(content | dict(more or {}) | files))
    return [folder / POPULATION, *written]
