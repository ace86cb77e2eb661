"""Pictures of a diagnosis: its answers, the effect in the data, and what is left of each run."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..display._signature_axes import signature_axis
from ._style import DOWN, MEASURED, PALETTE, UP, fine_unit, name_lines, one_axis, unit_text

MOST_ROWS = 4  # curves of a signature that can be told apart
MOST_ANSWERS = 8
LEAST_PROBABILITY = 1e-3


def answers(found: Sequence[tuple[str, float]], *, ax: Any = None) -> Any:
    """The probability of each answer, the likeliest on top: (name, probability) pairs.

    >>> from rapi_jax import plot
    >>> picture = plot.answers([("etalon", 0.97), ("none", 0.02), ("unlisted", 0.01)])
    >>> picture.axes[0].get_xlabel()
    'probability'
    """
    ranked = sorted(found, key=lambda pair: -pair[1])
    shown = [p for p in ranked if p[1] >= LEAST_PROBABILITY][:MOST_ANSWERS] or ranked[:1]
    figure, axis = one_axis(ax, (6.4, 1.2 + 0.34 * len(shown)))
    names, values = [name for name, _ in shown], [value for _, value in shown]
    axis.barh(range(len(shown)), values, color=UP, height=0.6)
    for row, value in enumerate(values):
        right = value > 0.8
        axis.text(
            value + (-0.01 if right else 0.01), row, f"{value:.3f}", va="center", fontsize=9,
            ha="right" if right else "left", color="white" if right else "black",
        )  # fmt: skip
    axis.set_yticks(range(len(shown)), names)
    axis.set_ylim(len(shown) - 0.3, -0.7)
    axis.set_xlim(0.0, 1.0)
    axis.set_xlabel("probability")
    axis.set_title("what explains the gap", fontsize=10)
    return figure


def signature(found: Mapping[str, Any], unit: str, *, ax: Any = None) -> Any:
    """The mean residual over the axis in which an effect is regular, without and with it.

    `found`: an entry of `signature` in `diagnosis.json`; `unit`: of the response. The line is what
    the effect explains. Of many curves the four are drawn of which it explains most.

    >>> from rapi_jax import plot
    >>> row = {"row": "up", "x": [0.0, 1.0, 2.0], "without": [0.1, -0.1, 0.1], "with": [0, 0, 0]}
    >>> entry = {"effect": "etalon", "axis": "response", "unit": "GHz", "rows": [row]}
    >>> plot.signature(entry, "GHz").axes[0].get_xlabel()
    'optical frequency (GHz)'
    """
    gain = found["axis"] == "gain"
    parts = sorted((_curves(row) for row in found["rows"]), key=lambda p: -_explained(p))
    shown = parts[:MOST_ROWS]
    largest = max((float(np.nanmax(np.abs(p["without"]), initial=0.0)) for p in shown), default=0.0)
    out, factor = ("%", 100.0) if gain else fine_unit(largest, unit)
    x_unit, scale = ("ms", 1e3) if found["axis"] == "since_turn" else (found["unit"], 1.0)
    figure, axis = one_axis(ax)
    for k, part in enumerate(shown):
        colour, x = PALETTE[k], scale * part["x"]
        label = part["row"] or "without it"
        axis.plot(x, factor * part["without"], "o", ms=3, color=colour, label=label)
        axis.plot(x, factor * part["explained"], lw=1.2, color=colour)
        axis.plot(x, factor * part["with"], ".", ms=3, color=MEASURED)
    axis.plot([], [], "-", lw=1.2, color="black", label="what it explains")
    axis.plot([], [], ".", ms=3, color=MEASURED, label="left with it")
    axis.axhline(0.0, lw=0.8, color="black")
    if found["axis"] == "since_turn":
        axis.set_xscale("log")
    over = signature_axis(found["axis"], unit) + (", folded" if found.get("period") else "")
    axis.set_xlabel(over if x_unit == "1" else f"{over} ({unit_text(x_unit)})")
    axis.set_ylabel("slope of the residual (%)" if gain else f"mean residual ({out})")
    axis.set_title(f"{found['effect'].replace('_', ' ')} in the data", fontsize=10)
    name_lines(figure, axis, ax is None)
    return figure


def gap_of_runs(
    runs: Sequence[Mapping[str, Any]], floor: float, unit: str, *, ax: Any = None
) -> Any:
    """The rms residual of each run without the named effects and with them, and the noise.

    `runs`: as `by_run` in `diagnosis.json`, of which `name`, `before` and `after` are read.

    >>> from rapi_jax import plot
    >>> runs = [{"name": "run00", "before": 0.21, "after": 0.021}]  # GHz
    >>> plot.gap_of_runs(runs, 0.02, "GHz").axes[0].get_ylabel()
    'rms residual (MHz)'
    """
    before, after = (
        np.array([float(run[key] or 0.0) for run in runs]) for key in ("before", "after")
    )
    largest = float(max(before.max(initial=0.0), after.max(initial=0.0)))
    unit, factor = fine_unit(largest, unit)
    figure, axis = one_axis(ax, (max(4.0, 1.6 + 0.6 * len(runs)), 3.4))
    at = np.arange(len(runs))
    axis.bar(at - 0.2, factor * before, 0.4, color=DOWN, label="without the effects named")
    axis.bar(at + 0.2, factor * after, 0.4, color=UP, label="with them")
    axis.axhline(factor * floor, lw=1.2, ls="--", color="black", label="noise")
    tilted = 30 if len(runs) > 4 else 0
    axis.set_xticks(at, [str(run["name"]) for run in runs], rotation=tilted)
    axis.set_ylabel(f"rms residual ({unit})")
    axis.set_title("what is left of each run", fontsize=10)
    axis.set_ylim(0.0, 1.4 * factor * max(largest, floor) or 1.0)  # room for the legend
    axis.legend(frameon=False, fontsize=8, loc="upper right")
    return figure


def _curves(row: Mapping[str, Any]) -> dict[str, Any]:
    """The columns of a signature's row as arrays, NaN where there is none."""
    columns = {key: np.array(row[key], dtype=float) for key in ("x", "without", "with")}
    explained = columns["without"] - columns["with"]
    return {**columns, "explained": explained, "row": row.get("row") or ""}


def _explained(part: Mapping[str, Any]) -> float:
    """Mean square of what the effect explains."""
    values = part["explained"][np.isfinite(part["explained"])]
    return float(np.mean(values**2)) if values.size else 0.0
