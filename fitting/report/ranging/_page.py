"""The page of ranging: one HTML file that needs nothing but itself, and no script."""

import functools
from typing import Any

import jinja2

from fitting.report._pages import PagePicture, load_template, read_style
from fitting.report.diagnosis._numbers import DASH, finite_or_none, format_number, format_quantity

from . import _words as words

_MOST = 2000  # rows of the page's table of scans; all are in the CSV file


def render_page(content: dict[str, Any], picture: PagePicture | None = None) -> str:
    """The ranging of `range.json` as one HTML page. Text in it is shown as text.

    `picture`: distances over time.
    """
    name = content.get("name") or ""
    scans = [_scan(row) for row in content["scans"][:_MOST]]
    problems = any(row[-1] for row in scans)
    return _load_template().render(
        title=" · ".join(filter(None, ["Distance", name])),
        headline=words.headline(content),
        facts=words.facts(content),
        subtitle=_subtitle(content),
        picture=picture,
        faults=[line[:1].upper() + line[1:] for line in words.fold(content["faults"])],
        budget=_budget(content["budget"]),
        scans=[row if problems else row[:-1] for row in scans],
        problems=problems,
        left_out=max(0, len(content["scans"]) - _MOST),
        track=[_state(row) for row in content["track"][:_MOST]],
        provenance=_provenance(content),
        style=read_style(),
    )


def _subtitle(content: dict[str, Any]) -> str:
    times = [row["time_s"] for row in content["scans"] if row["time_s"] is not None]
    set_up = content["set_up"]
    count = set_up["records"]
    over = f" over {max(times) - min(times):.4g} s" if len(times) > 1 else ""
    return (
        f"{len(content['scans'])} scans{over} at {set_up['excitation_hz']:g} Hz in {count} "
        f"record{'s' if count != 1 else ''}; times are those of the session, distances of the "
        "middle of each scan."
    )


def _budget(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows with the share of the largest line, for bars."""
    sizes = [finite_or_none(line["stderr"]) or 0.0 for line in lines]
    most = max(sizes, default=0.0) or 1.0
    return [
        {
            "source": line["source"],
            "stderr": words.budget_size(line),
            "note": line.get("note") or "",
            "width": 100 * size / most,
        }
        for line, size in zip(lines, sizes, strict=True)
    ]


def _scan(row: dict[str, Any]) -> list[str]:
    return [
        format_number(row["time_s"], 5),
        row["direction"],
        words.distance(row["distance"], row["stderr"]),
        words.length(row["apparent_stderr"], digits=2),
        format_quantity(_times(row["span_hz"], 1e-9), "GHz", digits=5),
        format_quantity(_times(row["nonlinearity_hz"], 1e-6), "MHz"),
        row["problem"],
    ]


def _state(row: dict[str, Any]) -> list[str]:
    return [
        format_number(row["time_s"], 5),
        words.distance(row["distance"], row["distance_stderr"]),
        words.speed(row["velocity"], row["velocity_stderr"]),
        "outlier, not counted" if row.get("gated") else "",
    ]


def _times(value: Any, factor: float) -> float | None:
    x = finite_or_none(value)
    return None if x is None else x * factor


def _provenance(content: dict[str, Any]) -> list[tuple[str, str]]:
    set_up = content["set_up"]
    spacing = set_up["cavity_spacing_hz"]
    phase = content.get("air_phase_index")
    return [
        ("wavelength", f"{1e9 * set_up['wavelength_m']:.7g} nm in vacuum"),
        ("phase index", f"{phase:.8f}" if phase is not None else DASH),
        ("cavity", f"{spacing / 1e9:g} GHz free spectral range" if spacing else "none"),
        ("sampling", format_quantity(set_up["sample_hz"] / 1e6, "MHz", digits=4)),
        ("versions", ", ".join(f"{k} {v}" for k, v in content["versions"].items())),
    ]


@functools.cache
def _load_template() -> jinja2.Template:
    return load_template("fitting.report.ranging", "range.html")
