"""What the page of a batch shows, as plain numbers, lists and names."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting._json import replace_nonfinite
from fitting._multiple_tests import adjust_holm

from ._read import Result
from ._thresholds import THRESHOLDS
from .statistics._drift import Drift, find_drift
from .statistics._groups import Group, make_groups, session_time
from .statistics._outliers import Comparison, compare_recordings, robust_scale

_PAGES = ("report.html", "model.json", "diagnosis.json", "certificate.json", "range.json")


def summarise(results: Sequence[Result]) -> dict[str, Any]:
    """The object that the page is made of. Numbers that are not finite are None."""
    rows = [_row(one) for one in results]
    parts = _analyse(results, make_groups(results))
    return replace_nonfinite(
        {
            "significance": THRESHOLDS.significance,
            "fewest_compared": THRESHOLDS.fewest_compared,
            "fewest_in_time": THRESHOLDS.fewest_in_time,
            "permutations": THRESHOLDS.permutations,
            "rows": rows,
            "groups": parts,
        }
    )


def _row(one: Result) -> dict[str, Any]:
    record, figures = one.record, one.row.figures
    first = next((name for name in _PAGES if name in record.files), None)
    keys = ("rmse", "rmse_held_out", "unit", "verdict", "probability", "reasons", "set")
    return {
        "name": record.name,
        "task": record.task,
        "status": record.status if one.done or record.status != "done" else "unreadable",
        "exit_code": record.exit_code,
        "trusted": one.trusted,
        "message": one.message,
        "seconds": record.seconds,
        "tries": record.tries,
        "page": first,
        **{key: figures.get(key) for key in (*keys, "faults", "method", "at_bound")},
        **{key: figures.get(key) for key in ("nonlinearity_max", "expected_high")},
        "estimates": {
            name: {"value": e.value, "stderr": e.stderr, "unit": e.unit}
            for name, e in one.row.estimates.items()
        },
    }


def _analyse(results: Sequence[Result], groups: list[Group]) -> list[dict[str, Any]]:
    """Each group's parameters, trends and outliers; corrected for the tests of all groups."""
    compared = [compare_recordings(group.values, group.covariance) for group in groups]
    times = [session_time(results, group.index.tolist()) for group in groups]
    trends = [
        find_drift(time, group.values, group.stderr)
        for group, (time, _) in zip(groups, times, strict=True)
    ]
    # One correction over all groups: the claims are of the page.
    together = adjust_holm(
        np.concatenate([c.raw for c in compared if c is not None] or [np.empty(0)])
    )
    drifting = adjust_holm(
        np.concatenate([t.raw for t in trends if t is not None] or [np.empty(0)])
    )
    parts, at, to = [], 0, 0
    for group, comparison, trend, (time, hours) in zip(
        groups, compared, trends, times, strict=True
    ):
        p = drift_p = None
        if comparison is not None:
            p, at = together[at : at + len(group.index)], at + len(group.index)
        if trend is not None:
            drift_p, to = drifting[to : to + len(group.names)], to + len(group.names)
        parts.append(_part(group, comparison, p, trend, drift_p, time, hours))
    return parts


def _part(
    group: Group,
    comparison: Comparison | None,
    p: np.ndarray | None,
    trend: Drift | None,
    drift_p: np.ndarray | None,
    time: np.ndarray,
    hours: bool,
) -> dict[str, Any]:
    middle, spread = robust_scale(group.values)
    parameters = []
    for k, name in enumerate(group.names):
        entry: dict[str, Any] = {
            "name": name,
            "unit": group.units[k],
            "values": group.values[:, k].tolist(),
            "stderr": group.stderr[:, k].tolist(),
            "median": float(middle[k]),
            "spread": float(spread[k]),
            "typical_stderr": float(np.median(group.stderr[:, k])),
            "scatter": None if comparison is None else float(comparison.scatter[k]),
            "drift": None,
        }
        if trend is not None and drift_p is not None:
            entry["drift"] = {
                "change": float(trend.change[k]),
                "stderr": float(trend.stderr[k]),
                "p": float(drift_p[k]),
                "middle": float(trend.middle[k]),
                "mean_time": float(trend.mean_time[k]),
                "found": bool(drift_p[k] < THRESHOLDS.significance),
            }
        parameters.append(entry)
    outliers = []
    if comparison is not None and p is not None:
        outliers = [
            {
                "row": int(group.index[i]),
                "p": float(p[i]),
                "z": comparison.z[i].tolist(),
                "given": comparison.given[i].tolist(),
            }
            for i in np.flatnonzero(p < THRESHOLDS.significance)
        ]
    return {
        "kind": list(group.kind),
        "index": group.index.tolist(),
        "compared": comparison is not None,
        "together": comparison is not None and comparison.together,
        "time": time.tolist(),
        "hours": hours,
        "parameters": parameters,
        "outliers": sorted(outliers, key=lambda one: one["p"]),
    }
