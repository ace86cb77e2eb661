"""Folders of jobs as a batch leaves them, from hand-written results."""

import json
from pathlib import Path
from typing import Any

import diagnoses
import numpy as np

from fitting._result_files import hash_files
from fitting.batch._record import JobRecord

NAMES = ("alpha", "zeta", "lam", "eta")
UNITS = ("1", "V/Hz", "1", "1")
CENTRE = np.array([0.2811, 6.7126e-3, 1.6, 1.0])
STDERR = np.array([9e-4, 2.6e-5, 2.5e-4, 6e-3])
CORRELATION = np.array(
    [[1.0, 0.9, -0.3, -0.95], [0.9, 1.0, -0.2, -0.9], [-0.3, -0.2, 1.0, 0.2], [-0.95, -0.9, 0.2, 1]]
)
HOSTILE = (
    "=HYPERLINK(\"http://evil.example\")",
    "+1",
    "-2+3",
    "@SUM(A1)",
    "\uff1dcmd",
    "  =1",
    "a;=1|-2",
    "a,b\"c",
    "\x1b[31mred\x07",
    "line\nbreak\r",
    diagnoses.HOSTILE,
)  # fmt: skip


def model(
    values=CENTRE,
    stderr=STDERR,
    *,
    names=NAMES,
    units=UNITS,
    operator: str = "RAPI",
    trusted: bool = True,
    correlation=CORRELATION,
) -> dict[str, Any]:
    """The object of a `model.json`."""
    parameters = {
        name: {"value": v, "stderr": e, "unit": unit, "at_bound": False, "bounds": [None, None]}
        | {"held": False}
        for name, v, e, unit in zip(
            names, np.asarray(values).tolist(), np.asarray(stderr).tolist(), units, strict=True
        )
    }
    parameters["origin"] = {"value": 0.0, "stderr": 0.0, "unit": "V", "at_bound": False}
    parameters["origin"] |= {"held": True}
    return {
        "schema": "rapi.model/1",
        "operator": operator,
        "effects": [],
        "parameters": parameters,
        "correlation": {"names": list(names), "matrix": np.asarray(correlation).tolist()},
        "unit": "GHz",
        "drive_unit": "V",
        "rmse": 0.0197,
        "rmse_held_out": 0.0204,
        "verdict": {
            "trusted": trusted,
            "reasons": [] if trusted else ["too few periods to tell"],
            "notes": [],
            "unidentifiable": [],
            "with_gap": False,
        },
        "claim": {"rms": 0.02, "low": 0.019, "high": 0.0212, "noise": 0.0197, "unit": "GHz"},
        "faults": [{"kind": "hop", "run": "run00", "message": "run00: a mode hop", "samples": []}],
        "seconds": 0.2,
        "versions": {},
        "data_sha256": "ab" * 32,
    }


def certificate() -> dict[str, Any]:
    """The object of a `certificate.json`."""
    drive = {"excitation_hz": 10.0, "span": 75.0, "inverse": "exact", "drive_min": 0.8}
    drive |= {"drive_max": 5.2, "slew_max": 120.0, "nonlinearity": {"up": 1e-4, "down": 3e-4}}
    drive |= {"certificate": {"invertible": True, "slope_min": 11.5}}
    fast = drive | {"excitation_hz": 40.0, "drive_max": 5.5, "slew_max": 480.0}
    return {
        "schema": "rapi.compensation/1",
        "unit": "GHz",
        "drive_unit": "V",
        "drives": [drive, fast],
        "expected": {"rms": 0.004, "high": 0.009, "low": 0.0, "unit": "GHz"},
        "notes": [],
        "data_sha256": "cd" * 32,
    }


def ranging() -> dict[str, Any]:
    """The object of a `range.json`."""
    summary = {"distance": 0.7, "stderr": 2e-6, "scatter": 3e-6, "velocity": 0.005}
    summary |= {"velocity_stderr": 1e-7, "scans": 20, "counted": 19}
    return {"schema": "rapi.range/1", "unit": "m", "air_index": 1.00027, "summary": summary} | {
        "method": "resample-phase",
        "faults": [],
    }


def write_job(
    folder: Path,
    name: str,
    results: dict[str, Any],
    *,
    task: str = "fit",
    place: str | None = None,
    **fields: Any,
) -> JobRecord:
    """Write `results` (by file name) into the job's folder; `place`: the folder's name."""
    where = folder / (place or name)
    where.mkdir(parents=True)
    for file, content in results.items():
        text = content if isinstance(content, str) else json.dumps(content)
        (where / file).write_text(text, encoding="utf-8")
    given = {
        "status": "done" if results else "failed",
        "exit_code": 0 if results else 3,
        "message": "" if results else "run00: 3 samples are NaN, the first at 17.",
        "provenance": {},
    } | fields
    files = {file: str(found) for file, found in hash_files(where / f for f in results).items()}
    return JobRecord(
        name=name,
        recording=f"data/{name}.nc",
        task=task,
        key="0" * 64,
        seconds=0.25,
        tries=1,
        started_at="2026-11-24T10:00:00+00:00",
        files=files,
        **given,
    )


def fits(folder: Path, values: np.ndarray, *, hours: bool = True, **more: Any) -> list[JobRecord]:
    """A job a row of `values`, each recorded a quarter of an hour after the one before."""
    return [
        write_job(
            folder,
            f"rec{i:04d}",
            {"model.json": model(row, **more)},
            provenance={
                "recorded_at": f"2026-11-{1 + i // 96:02d}T{i // 4 % 24:02d}:{i % 4 * 15:02d}Z"
            }
            if hours
            else {},
        )
        for i, row in enumerate(values)
    ]


def scattered(count: int, seed: int = 0) -> np.ndarray:
    """Estimates with their errors' correlation, and twice as much scatter between recordings."""
    rng = np.random.default_rng(seed)
    factor = np.linalg.cholesky(CORRELATION)
    errors = rng.standard_normal((count, len(NAMES))) @ factor.T
    return CENTRE + STDERR * (errors + 2.0 * rng.standard_normal((count, len(NAMES))))
