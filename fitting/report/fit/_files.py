"""The files of a fit."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting._json import json_text
from fitting._result_files import begin_result, list_files
from fitting._versions import package_versions
from rapi_jax import Identified
from rapi_jax.io import write_atomic, write_model

from ._page import PAGE, render_page

if TYPE_CHECKING:
    from fitting.identification._result import FitResult

MODEL, TABLE = "model.rapi", "model.json"
PICTURES = ("loops.png", "residuals.png", "starts.png")


def save_figure(figure: Any, path: Path) -> Path:
    """Write a figure of `rapi_jax.plot` as PNG, whole or not at all."""
    from rapi_jax.plot import png

    write_atomic(path, png(figure))
    return path


def write_fit(
    result: "FitResult",
    folder: Path,
    *,
    plots: bool,
    more: Mapping[str, Any] | None = None,
    files: Mapping[str, bytes] | None = None,
    source: str | None = None,
) -> list[Path]:
    """Write the loadable model, pictures, page and, last, `model.json`; return their paths.

    `more`: further keys of `model.json`. `files`: others that belong to the result, by name.
    `source`: where the recording is, for the command that the page advises.
    """
    recording = result.recording
    pictures = PICTURES if plots else ()
    page = (PAGE,) if plots else ()
    others = dict(files or {})
    earlier = begin_result(folder, TABLE, [MODEL, *pictures, *page, *others])
    write_model(
        folder / MODEL,
        result.ecdl,
        response_unit=recording.response_unit,
        drive_unit=recording.drive_unit,
        response_origin=recording.response_origin,
        response_lag_s=recording.response_lag_s,
        trusted=result.verdict.trusted,
        reasons=list(result.verdict.reasons),
        claim=result.to_dict()["claim"],
        identified=Identified.of(recording, swings_joined=result.swings_joined).to_dict(),
        rmse=result.rmse,
        versions=package_versions(),
        data_sha256=result.data_sha256 or recording.sha256(),
    )
    written = [folder / MODEL]
    if plots:
        figures = (result.plot.loops(), result.plot.residuals(), result.plot.starts())
        written += [
            save_figure(figure, folder / name)
            for name, figure in zip(pictures, figures, strict=True)
        ]
        write_atomic(folder / PAGE, render_page(result, source))
        written.append(folder / PAGE)
    for name, content in others.items():
        write_atomic(folder / name, content)
        written.append(folder / name)
    table = result.to_dict() | dict(more or {}) | list_files(written, earlier)
    write_atomic(folder / TABLE, json_text(table))
    return [folder / TABLE, *written]
