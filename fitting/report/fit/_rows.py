"""The rows of a fit's tables, as a console and a page show them: its runs and its starts."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fitting._units import readable_unit, significant

if TYPE_CHECKING:
    from fitting.identification._result import FitResult

_FEW_STARTS = 6  # rows that a reader takes in; more are told by kind
# An error is a third of what it is, or less, once the other parameter is known: sqrt(1 - 0.95^2).
_TOGETHER = 0.95


class Rows(NamedTuple):
    """A table's heads and rows, as text."""

    heads: tuple[str, ...]
    rows: list[tuple[str, ...]]


def format_number(value: float, digits: int = 4) -> str:
    """A number with so many significant digits; a dash where there is none."""
    return "-" if value is None or not np.isfinite(value) else significant(value, digits)


def list_runs(result: "FitResult", scale: tuple[str, float] | None = None) -> Rows:
    """Each run: rate, periods, loop, weight and what the model leaves.

    `scale`: the unit of errors and the factor to it, by default that in which they read best.
    """
    recorded = result.recording.response_unit
    unit, factor = scale or readable_unit(recorded, (r.rmse for r in result.runs))
    heads = (
        "run", "rate (Hz)", "periods", "loop (%)", "weight", f"rmse ({unit})", "% of span", "rho",
    )  # fmt: skip
    rows = [
        (
            run.name,
            format_number(run.excitation_hz) if run.excitation_hz else "-",
            str(run.periods),
            format_number(100 * run.hysteresis, 3),
            format_number(run.weight, 3),
            format_number(factor * run.rmse),
            format_number(100 * run.rmse_fraction, 3),
            format_number(run.rho, 3),
        )
        for run in result.runs
    ]
    return Rows(heads, rows)


def describe_runs(result: "FitResult") -> str:
    """The rms of what the model leaves in the best and the worst of several runs; else nothing."""
    if len(result.runs) < 2:
        return ""
    runs = sorted(result.runs, key=lambda run: run.rmse)
    unit, factor = readable_unit(result.recording.response_unit, (run.rmse for run in runs))
    ends = (
        f"{format_number(factor * run.rmse, 3)} {unit} ({run.name})" for run in (runs[0], runs[-1])
    )
    return f"{len(runs)} runs: rmse {' to '.join(ends)}."


def list_starts(result: "FitResult") -> Rows:
    """Each start of the solver, or each kind of them: steps, cost and where it ended."""
    rows = []
    for alike in _alike(result.starts):
        first, last = alike[0], alike[-1]
        more = "" if first is last else f" and {len(alike) - 1} more"
        end = last.describe()
        end = end if first is last else end.replace(", cost ", ", cost up to ")
        steps = _joined(*(str(f(start.steps for start in alike)) for f in (min, max)))
        cost = _joined(*(format_number(one.cost, 7) for one in (first, last)))
        rows.append((f"{first.origin}{more}", steps, cost, end))
    return Rows(("start", "steps", "cost", "end"), rows)


def _alike(starts: Sequence[Any]) -> list[list[Any]]:
    """Starts whose ends are told in the same words but for numbers, in the order of their cost.

    Each by itself where they are few.
    """
    if len(starts) <= _FEW_STARTS:
        return [[start] for start in starts]
    kinds: dict[str, list[Any]] = {}
    for start in sorted(starts, key=lambda start: start.cost):
        kinds.setdefault(re.sub(r"\d[\d.e+-]*", "#", start.describe()), []).append(start)
    return list(kinds.values())


def _joined(low: str, high: str) -> str:
    return low if low == high else f"{low} to {high}"


def known_together(result: "FitResult") -> list[tuple[str, str, float]]:
    """The pairs of parameters of which the data tell a combination far better than either.

    With the correlation of their errors, the largest first.
    """
    listed = {p.name for p in result.parameters}
    names, matrix = result.names, np.asarray(result.correlation)
    pairs = [
        (one, other, float(matrix[i, j]))
        for i, one in enumerate(names)
        for j, other in enumerate(names[:i])
        if {one, other} <= listed and abs(matrix[i, j]) > _TOGETHER
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def describe_together(result: "FitResult", most: int = 3) -> str:
    """What is known only together, and that a prediction needs no more; empty where nothing is."""
    pairs = known_together(result)
    if not pairs:
        return ""
    named = ", ".join(f"{b} and {a} ({r:+.3f})" for a, b, r in pairs[:most])
    rest = len(pairs) - most
    more = f", and {rest} more pair{'s' * (rest > 1)}" if rest > 0 else ""
    return (
        f"Strongly correlated parameters (correlation of their errors): {named}{more}. Their "
        "combination is known better than either value. Predictions and the verdict depend on the "
        "combination; each value by itself is known only to its standard error."
    )
