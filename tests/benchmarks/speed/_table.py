"""The rows as a Markdown table, and as JSON."""

import dataclasses
import json
import os
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from ._paired import Row

HEAD = (
    "work",
    "ours",
    "peer",
    "ours takes",
    "peer takes",
    "peer / ours (range)",
    "cost: start",
    "end, ours; peer",
)
_UNITS = ((1.0, "s", 1.0), (1e-3, "ms", 1e3), (0.0, "us", 1e6))


def quantity(value: float | None, unit: str) -> str:
    """A number with its unit, to three digits; seconds in the prefix that suits."""
    if value is None:
        return ""
    if unit != "s":
        return f"{value:.3g} {unit}"
    short, scale = next((name, scale) for least, name, scale in _UNITS if value >= least)
    return f"{value * scale:.3g} {short}"


def _ratio(row: Row) -> str:
    if row.ratio is None:
        return row.note
    spread = f" ({min(row.ratios):.3g} to {max(row.ratios):.3g})" if len(row.ratios) > 1 else ""
    return f"{row.ratio:.3g}{spread}" + (f"; {row.note}" if row.note else "")


def _costs(row: Row) -> tuple[str, str]:
    start = "" if row.start_cost is None else f"{row.start_cost:.6g}"
    ended = [f"{cost:.7g}" for cost in (row.ours_cost, row.peer_cost) if cost is not None]
    return start, "; ".join(ended)


def markdown(rows: Sequence[Row]) -> str:
    """One table of all rows."""
    lines = [HEAD, ("---",) * len(HEAD)]
    for row in rows:
        times = (quantity(value, row.unit) for value in (row.ours_value, row.peer_value))
        lines.append((row.work, row.ours, row.peer, *times, _ratio(row), *_costs(row)))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def machine() -> dict[str, Any]:
    """What the figures were taken with."""
    names = ("jax", "numpy", "scipy", "numba", "joblib", "optimistix")
    found = {d.metadata["Name"].lower(): d.version for d in metadata.distributions()}
    return {
        "cores": os.cpu_count(),
        "processor": _processor(),
        "load": os.getloadavg(),  # of the machine at the end; this suite alone makes 1 to 2
        "python": platform.python_version(),
        "versions": {name: found.get(name) for name in names},
        "OPENBLAS_NUM_THREADS": os.environ.get("OPENBLAS_NUM_THREADS"),
        "XLA_FLAGS": os.environ.get("XLA_FLAGS"),
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor()


def write_json(path: Path, rows: Sequence[Row], **more: Any) -> None:
    """All rows with the ratio of every round, and `more`."""
    fields = [dataclasses.asdict(row) | {"ratio": row.ratio} for row in rows]
    path.write_text(json.dumps({"machine": machine(), "rows": fields, **more}, indent=1) + "\n")
