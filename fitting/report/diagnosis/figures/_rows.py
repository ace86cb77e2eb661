"""Rows of a map: in the page's unit, in order of scan rate, named, and where they peak."""

from typing import Any

from fitting.report.diagnosis._numbers import Scale, finite, number
from fitting.report.diagnosis._text import run_label, run_name

from ._figure import Table, finites

Row = tuple[str, list[float | None]]
_PLAIN = (str, int, float)


def scaled(values: Any, scale: Scale) -> list[float | None]:
    """A row of residuals in the page's unit."""
    return [scale.value(v) for v in finites(values)]


def by_rate(rows: list[dict]) -> list[dict]:
    """Rows from slow to fast, then from small to large, runs that are not periodic last."""

    def key(row: dict) -> tuple:
        rate, size = finite(row.get("excitation_hz")), finite(row.get("amplitude"))
        return (rate is None, rate or 0.0, size or 0.0, finite(row.get("run")) or 0.0)

    return sorted(rows, key=key)


def known_runs(diagnosis: dict, drive_unit: str) -> dict[Any, dict]:
    """Runs by number, each with a `label`: what was done, and the name where scans repeat."""
    maps = diagnosis.get("maps") or {}
    entries = list(diagnosis.get("where") or [])
    for key in ("phase", "harmonics", "frequency"):
        entries += (maps.get(key) or {}).get("rows") or []
    runs: dict[Any, dict] = {}
    for e in entries:
        run = runs.setdefault(e.get("run"), {"run": e.get("run")})
        # A harmonic's row has an `amplitude` of its own, a list.
        own = (k for k in ("name", "excitation_hz", "amplitude") if isinstance(e.get(k), _PLAIN))
        run |= {key: e[key] for key in own if key not in run}
    plain = [run_label(run, drive_unit) for run in runs.values()]
    for run, text in zip(runs.values(), plain, strict=True):
        name = run_name(run)
        run["label"] = f"{text} · {name}" if plain.count(text) > 1 and name != text else text
    return runs


def peak(x: list[float | None], rows: list[Row]) -> tuple[str, int, float] | None:
    """Label, place and value of the largest residual; None where there is none at all."""
    cells = [
        (label, i, v)
        for label, values in rows
        for i, v in enumerate(values[: len(x)])
        if v is not None
    ]
    return max(cells, key=lambda cell: abs(cell[2]), default=None)


def values_table(
    caption: str, x_name: str, x: list[float | None], rows: list[Row], unit: str
) -> Table:
    """The numbers of a map: one line an x, one column a row of the map."""
    body = [
        [number(at), *(number(v[i], sign=True) if i < len(v) else "" for _, v in rows)]
        for i, at in enumerate(x)
    ]
    return Table(f"{caption}, in {unit}", [x_name, *(label for label, _ in rows)], body)
