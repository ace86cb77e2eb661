"""The files of ranging: JSON and CSV for machines, a page and a picture for people."""

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting._json import json_text
from fitting._result_files import begin_result, list_files
from fitting.report.fit._files import save_figure
from rapi_jax.io import write_atomic

if TYPE_CHECKING:
    from rapi_jax.ranging import Ranging

RANGE, TABLE, PAGE, PICTURE = "range.json", "range.csv", "report.html", "range.png"
_SCAN = (
    "time_s",
    "direction",
    "distance",
    "stderr",
    "span_hz",
    "apparent",
    "apparent_stderr",
    "nonlinearity_hz",
)
_STATE = ("distance", "distance_stderr", "velocity", "velocity_stderr")


def write_range(
    ranging: "Ranging", content: dict[str, Any], folder: Path, *, plots: bool = True
) -> list[Path]:
    """Write table, picture, page and, last, `range.json` of `content`; return their paths."""
    from fitting.report._pages import PagePicture
    from rapi_jax import plot

    from ._page import render_page

    names = [TABLE, PAGE, *([PICTURE] if plots else [])]
    earlier = begin_result(folder, RANGE, names)
    write_atomic(folder / TABLE, range_csv(content))
    picture = None
    if plots:
        figure = plot.ranging(ranging)
        save_figure(figure, folder / PICTURE)
        picture = PagePicture.of(figure)
    write_atomic(folder / PAGE, render_page(content, picture))
    files = list_files([folder / name for name in names], earlier)
    write_atomic(folder / RANGE, json_text(content | files))
    return [folder / RANGE, *(folder / name for name in names)]


def range_csv(content: dict[str, Any]) -> str:
    """A row per scan: m, s, Hz; a number that is missing is left empty.

    `track_distance` and the like are those of the track at the scan's middle.
    """
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(
        [*_SCAN, "track_distance", "track_stderr", "velocity", "velocity_stderr", "problem"]
    )
    track = {row["time_s"]: row for row in content["track"]}
    for scan in content["scans"]:
        state = track.get(scan["time_s"], {})
        row = [*(scan[name] for name in _SCAN), *(state.get(name) for name in _STATE)]
        out.writerow(["" if x is None else x for x in row] + [scan["problem"]])
    return text.getvalue()
