"""The files of a comparison: JSON for machines, one page for people."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting._json import json_text
from fitting._result_files import begin_result, list_files
from rapi_jax.io import write_atomic

from ._page import render_page

COMPARISON, PAGE = "comparison.json", "report.html"


def write_comparison(
    content: dict[str, Any],
    folder: Path,
    *,
    names: tuple[str, str] = ("", ""),
    more: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Write `report.html` and, last, `comparison.json`; return their paths.

    `names`: of the recordings before and after, as page and file show them. `more`: further keys of
    the JSON.
    """
    recordings = {
        key: one | {"name": name}
        for (key, one), name in zip(content["recordings"].items(), names, strict=True)
    }
    content = content | {"recordings": recordings}
    earlier = begin_result(folder, COMPARISON, [PAGE])
    write_atomic(folder / PAGE, render_page(content))
    files = list_files([folder / PAGE], earlier)
    write_atomic(folder / COMPARISON, json_text(content | dict(more or {}) | files))
    return [folder / COMPARISON, folder / PAGE]
