"""The content of `range.json`: plain numbers, lists and names, key by key."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting._json import replace_nonfinite
from fitting._versions import package_versions
from rapi_jax.internal import SPEED_OF_LIGHT

if TYPE_CHECKING:
    from rapi_jax.ranging import Ranging

SCHEMA = "rapi.range/1"


def range_content(
    ranging: "Ranging",
    *,
    budget: Sequence[Any] = (),
    phase_index: float | None = None,
    expected_m: tuple[float, float] | None = None,
    seconds: float | None = None,
    name: str = "",
) -> dict[str, Any]:
    """The object of `range.json`. Numbers that are not finite are null.

    **Arguments:**

    - `budget`: lines with `source`, `stderr` (m) and `note`. `phase_index`: of the air.
    - `name`: of the records. `seconds`: that reading them took.
    """
    index, records, summary = ranging.air_index, ranging.records, ranging.summary
    return replace_nonfinite(
        {
            "schema": SCHEMA,
            "unit": "m",
            "name": name,
            "air_index": index.value,
            "air_index_stderr": index.stderr if index.parts else None,
            "air_phase_index": phase_index,
            "method": ranging.method,
            "summary": {
                "distance": summary.distance,
                "stderr": summary.stderr,
                "scatter": summary.scatter,
                "velocity": summary.velocity,
                "velocity_stderr": summary.velocity_stderr,
                "scans": summary.scans,
                "counted": summary.counted,
            },
            "scans": _scans(ranging),
            "track": _track(ranging),
            "budget": [
                {"source": one.source, "stderr": float(one.stderr), "note": one.note}
                for one in budget
            ],
            "faults": list(ranging.faults),
            "scale": _scale(ranging),
            "set_up": {
                "records": len(records.records),
                "sample_hz": records.sample_hz,
                "excitation_hz": records.excitation_hz,
                "wavelength_m": records.wavelength_m,
                "interferometer_path_m": records.interferometer_path_m,
                "cavity_spacing_hz": records.cavity_spacing_hz,
            },
            "expected_m": None if expected_m is None else list(expected_m),
            "seconds": seconds,
            "versions": package_versions(),
        }
    )


def _scans(ranging: "Ranging") -> list[dict[str, Any]]:
    table, index = ranging.table, ranging.air_index.value
    return [
        {
            "time_s": float(table.time_s[k]),
            "direction": "up" if table.rising[k] else "down",
            "distance": float(ranging.distance[k]),
            "stderr": float(ranging.stderr[k]),
            "span_hz": float(table.span_hz[k]),
            "apparent": float(table.path[k] / index),
            "apparent_stderr": float(table.stderr[k] / index),
            "nonlinearity_hz": float(1e9 * table.bend_ghz[k]),
            "problem": table.problem[k],
        }
        for k in range(table.size)
    ]


def _track(ranging: "Ranging") -> list[dict[str, Any]]:
    track = ranging.target.track
    if track is None:
        return []
    names = ("time_s", "distance", "distance_stderr", "velocity", "velocity_stderr")
    columns = [np.asarray(getattr(track, name), dtype=float).tolist() for name in names]
    gated = np.asarray(track.gated).tolist()
    return [
        dict(zip(names, row, strict=True)) | {"gated": out}
        for *row, out in zip(*columns, gated, strict=True)
    ]


def _scale(ranging: "Ranging") -> dict[str, Any]:
    """Delay of the interferometer, and the path that it is in vacuum."""
    scale = ranging.scale
    told = bool(np.isfinite(scale.stderr_s))
    return {
        "told_by": "cavity" if told else "interferometer_path_m",
        "delay_s": scale.delay_s,
        "stderr": scale.stderr_s,
        "path_m": scale.delay_s * SPEED_OF_LIGHT,
        "comb_hz": scale.comb_hz,
    }
