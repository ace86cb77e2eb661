"""The files of a diagnosis: JSON for machines, one page for people, the loadable model."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting._json import json_text
from fitting._result_files import begin_result, list_files
from fitting._versions import package_versions
from fitting.report.fit._files import MODEL
from rapi_jax import Identified
from rapi_jax.io import write_atomic, write_model

if TYPE_CHECKING:
    from fitting.diagnosis._diagnosis import Diagnosis

DIAGNOSIS, PAGE = "diagnosis.json", "report.html"


def write_diagnosis(
    diagnosis: "Diagnosis",
    folder: Path,
    *,
    name: str = "",
    more: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Write `model.rapi`, `report.html` and, last, `diagnosis.json`; return their paths.

    `name`: of the recording, as the page shows it. `more`: further keys of `diagnosis.json`.
    """
    from ._page import render_page

    recording = diagnosis.recording
    content = diagnosis.to_dict()
    if name:
        content["recording"]["name"] = name
    earlier, reasons = begin_result(folder, DIAGNOSIS, [MODEL, PAGE]), _reasons(diagnosis)
    write_model(
        folder / MODEL,
        diagnosis.model,
        response_unit=recording.response_unit,
        drive_unit=recording.drive_unit,
        response_origin=recording.response_origin,
        response_lag_s=recording.response_lag_s,
        trusted=not reasons,
        reasons=reasons,
        identified=Identified.of(recording).to_dict(),
        rmse=content["shrinkage"]["after"],
        versions=package_versions(),
        data_sha256=recording.sha256(),
    )
    write_atomic(folder / PAGE, render_page(content, diagnosis.labels))
    files = list_files([folder / MODEL, folder / PAGE], earlier)
    whole = content | dict(more or {}) | files
    write_atomic(folder / DIAGNOSIS, json_text(whole))
    return [folder / DIAGNOSIS, folder / PAGE, folder / MODEL]


def _reasons(diagnosis: "Diagnosis") -> list[str]:
    """Why no drive should be made from the model of a diagnosis; empty where one may be."""
    found = [f"{fault['kind']}: {fault['message']}" for fault in diagnosis.content["faults"]]
    if diagnosis.verdict.name == "unlisted" and not found:
        found = [
            "its diagnosis names no effect that explains the gap (probability "
            f"{100 * diagnosis.verdict.probability:.0f} %): compensate the model of `rapi fit`"
        ]
    elif diagnosis.verdict.name == "unlisted":
        found += ["its diagnosis names no effect that explains the gap"]
    return found
