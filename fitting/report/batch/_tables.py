"""Tables of the page of a batch: parameters, verdicts, failures, recordings."""

from collections import Counter
from typing import Any
from urllib.parse import quote

from fitting.report.diagnosis._numbers import (
    Scale,
    finite_or_none,
    format_number,
    format_percent,
    format_with_error,
    unit_text,
)

from . import _text as words

_STATUS = {"failed": "failed", "skipped": "skipped", "unreadable": "cannot be read"}


def link(row: dict) -> str:
    """Where a recording's own files are, relative to the page; empty where there are none."""
    return f"./{quote(row['name'], safe='')}/{row['page']}" if row["page"] else ""


def state(row: dict) -> str:
    """What became of a recording."""
    if row["status"] in _STATUS:
        return _STATUS[row["status"]]
    return {True: "trusted", False: "not to be trusted"}.get(row["trusted"], "done")


def tabulate_parameters(group: dict) -> list[list[str]]:
    """A row per parameter: centre, spread, standard error, scatter, trend."""
    rows = []
    for one in group["parameters"]:
        unit, drift = one["unit"], one["drift"]
        change = drift and format_with_error(drift["change"], drift["stderr"], "")
        rows.append(
            [
                one["name"],
                "" if unit == "1" else unit_text(unit),
                format_number(one["median"], 5),
                format_number(one["spread"]),
                format_number(one["typical_stderr"], 2),
                format_number(one["scatter"]),
                change or format_number(None),
                words.format_p(drift["p"] if drift else None),
            ]
        )
    return rows


def tabulate_verdicts(rows: list[dict]) -> list[dict[str, Any]]:
    """How many diagnoses name each effect, the most frequent first."""
    found = Counter(str(row["verdict"]) for row in rows if row["verdict"])
    total = sum(found.values())
    return [
        {"name": verdict, "count": number, "width": 100.0 * number / total}
        for verdict, number in found.most_common()
    ]


def tabulate_recordings(
    rows: list[dict], outlying: set[int], most: int
) -> tuple[list[str], list[dict[str, Any]]]:
    """Head and rows of the table of all recordings: each with its link and figures."""
    parameters = list(dict.fromkeys(key for row in rows for key in row["estimates"]))
    verdicts = any(row["verdict"] for row in rows)
    expected = any(finite_or_none(row["expected_high"]) is not None for row in rows)
    head = ["recording", "result", "rmse", "held out"]
    head += ["verdict", "probability"] * verdicts + ["nonlinearity", "expected"] * expected
    head += [*parameters, "time (s)"]
    body, scales = [], _scales(rows)
    for i, row in enumerate(rows[:most]):
        size = scales[str(row["unit"] or "")]
        cells = [size(row[key]) for key in ("rmse", "rmse_held_out")]
        if verdicts:
            cells += [row["verdict"] or "", format_percent(row["probability"])]
        if expected:
            cells += [size(row[k]) for k in ("nonlinearity_max", "expected_high")]
        for key in parameters:
            one = row["estimates"].get(key)
            cells.append(format_with_error(one["value"], one["stderr"], "") if one else "")
        cells.append(format_number(row["seconds"]))
        body.append(
            {
                "name": row["name"],
                "link": link(row),
                "state": state(row) + ("; stands out" if i in outlying else ""),
                "marked": i in outlying or row["status"] != "done" or row["trusted"] is False,
                "cells": cells,
            }
        )
    return head, body


def _scales(rows: list[dict]) -> dict[str, Scale]:
    """For each unit of a response that in which all errors of a batch are shown."""
    found: dict[str, list[float]] = {}
    for row in rows:
        sizes = (finite_or_none(row[key]) for key in ("rmse", "expected_high"))
        found.setdefault(str(row["unit"] or ""), []).extend(filter(None, sizes))
    return {unit: Scale.of(unit, [_median(sizes)]) for unit, sizes in found.items()}


def _median(sizes: list[float]) -> float:
    return sorted(sizes)[len(sizes) // 2] if sizes else 0.0


def tabulate_untrusted(rows: list[dict], most: int) -> list[dict[str, str]]:
    """Results that are not to be trusted, each with the reason."""
    chosen = [row for row in rows if row["status"] == "done" and row["trusted"] is False]
    return [
        {
            "name": row["name"],
            "link": link(row),
            "why": row["reasons"] or row["message"] or row["faults"] or "",
        }
        for row in chosen[:most]
    ]


def tabulate_failures(rows: list[dict], most: int) -> list[dict[str, str]]:
    """Recordings without a result, each with its one line."""
    chosen = [row for row in rows if row["status"] != "done"]
    return [
        {
            "name": row["name"],
            "link": link(row),
            "state": state(row),
            "code": str(row["exit_code"]),
            "tries": str(row["tries"]),
            "message": row["message"],
        }
        for row in chosen[:most]
    ]
