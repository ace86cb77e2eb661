"""The ranked hypotheses with their probabilities, parameters and closed fractions."""

from typing import Any

from fitting.report.charts._figure import Table

from . import _text as words
from ._numbers import (
    DASH,
    finite_or_none,
    format_interval,
    format_number,
    format_percent,
    format_with_error,
)

_SHOWN_AT_LENGTH = 0.01  # less probable ones go to a table, unless in the 95 % set


def tabulate_hypotheses(diagnosis: dict, labels: words.Labels) -> dict[str, Any] | None:
    """The likely ones at length, the others as a table, and what the 95 % set is."""
    inside = words.credible_names(diagnosis["verdict"])
    found = [h for h in diagnosis.get("hypotheses") or [] if isinstance(h, dict)]
    if not found:
        return None
    entries = [_describe_entry(h, set(inside), labels) for h in found]
    entries.sort(key=lambda h: -(h["probability"] or 0.0))
    shown = [h for h in entries if h["inside"] or (h["probability"] or 0.0) >= _SHOWN_AT_LENGTH]
    rest = [h for h in entries if h not in shown]
    weight = [h["probability"] for h in entries if h["inside"] and h["probability"] is not None]
    together = f", {format_percent(sum(weight))} together" if len(weight) > 1 else ""
    members = words.list_alternatives(inside, labels)
    return {
        "shown": shown,
        "others": _tabulate_others(rest) if rest else None,
        "shows": f"The smallest set with at least 95 % of the probability: {members}{together}. "
        "A line at the left marks it.",
    }


def _tabulate_others(rest: list[dict[str, Any]]) -> Table:
    head = ["hypothesis", "probability", "survival", "change of χ²", "gap closed"]
    rows = [[h["name"], *(h["numbers"].get(name, DASH) for name in head[1:])] for h in rest]
    odds = format_percent(sum(h["probability"] or 0.0 for h in rest))
    plural = "hypothesis" if len(rest) == 1 else "hypotheses"
    return Table(f"{len(rest)} other {plural}, {odds} in all", head, rows)


def _describe_entry(h: dict, inside: set[str], labels: words.Labels) -> dict[str, Any]:
    name = str(h.get("name") or "?")
    numbers = {
        "probability": format_percent(h.get("probability")),
        "survival": format_number(h.get("survival"), 2),
        "change of χ²": format_number(h.get("delta_chi2"), sign=True),
        "gap closed": format_interval(h.get("closed_fraction")),
    }
    shares = h.get("shares") or {}
    numbers |= {f"share of {effect}": format_percent(part) for effect, part in shares.items()}
    parameters = (h.get("parameters") or {}) | (h.get("derived") or {})
    return {
        "name": name,
        "title": words.capitalise(words.describe_hypothesis(name, labels)),
        "inside": name in inside,
        "probability": finite_or_none(h.get("probability")),
        "percent": numbers["probability"],
        "sentence": words.to_sentence(str(h.get("sentence") or "")),
        "numbers": numbers,
        # What is known of this hypothesis, for the line under it.
        "known": [(k, v) for k, v in numbers.items() if v != DASH and k != "probability"],
        "parameters": [
            (str(key), format_with_error(p.get("value"), p.get("stderr"), str(p.get("unit") or "")))
            for key, p in parameters.items()
            if isinstance(p, dict)
        ],
    }
