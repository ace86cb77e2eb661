"""Rows of a heat map: scaled to the page's unit, sorted by scan rate, labelled; their peak."""

from typing import Any

from fitting.report.charts._figure import Table, finite_values
from fitting.report.diagnosis._numbers import Scale, finite_or_none, format_number
from fitting.report.diagnosis._text import label_run, name_run

Row = tuple[str, list[float | None]]
_PLAIN = (str, int, float)


def scale_values(values: Any, scale: Scale) -> list[float | None]:
    """A row of residuals in the page's unit."""
    return [scale.value(v) for v in finite_values(values)]


def sort_by_rate(rows: list[dict]) -> list[dict]:
    """Rows from slow to fast, then from small to large, runs that are not periodic last."""

    def key(row: dict) -> tuple:
        rate, size = finite_or_none(row.get("excitation_hz")), finite_or_none(row.get("amplitude"))
        return (rate is None, rate or 0.0, size or 0.0, finite_or_none(row.get("run")) or 0.0)

    return sorted(rows, key=key)


def label_runs(diagnosis: dict, drive_unit: str) -> dict[Any, dict]:
    """Runs by number, each with a `label`: rate and amplitude, and its name where these repeat."""
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
    plain = [label_run(run, drive_unit) for run in runs.values()]
    for run, text in zip(runs.values(), plain, strict=True):
        name = name_run(run)
        run["label"] = f"{text} · {name}" if plain.count(text) > 1 and name != text else text
    return runs


def find_peak(x: list[float | None], rows: list[Row]) -> tuple[str, int, float] | None:
    """Label, index and value of the largest residual; None without any."""
    cells = [
        (label, i, v)
        for label, values in rows
        for i, v in enumerate(values[: len(x)])
        if v is not None
    ]
    return max(cells, key=lambda cell: abs(cell[2]), default=None)


def tabulate_values(
    caption: str, x_name: str, x: list[float | None], rows: list[Row], unit: str
) -> Table:
    """The numbers of a map: one line an x, one column a row of the map."""
    body = [
        [
            format_number(at),
            *(format_number(v[i], sign=True) if i < len(v) else "" for _, v in rows),
        ]
        for i, at in enumerate(x)
    ]
    return Table(f"{caption}, in {unit}", [x_name, *(label for label, _ in rows)], body)
