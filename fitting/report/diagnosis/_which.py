"""The ranked hypotheses, with what speaks for each."""

from typing import Any

from . import _text as words
from ._numbers import DASH, finite, interval, number, percent, with_error
from .figures._figure import Table

_SHOWN = 0.01  # Less likely ones go to a table, unless the 95 % set holds them.


def hypotheses(diagnosis: dict, labels: words.Labels) -> dict[str, Any] | None:
    """The likely ones at length, the others as a table, and what the 95 % set is."""
    inside = words.names(diagnosis["verdict"])
    found = [h for h in diagnosis.get("hypotheses") or [] if isinstance(h, dict)]
    if not found:
        return None
    entries = [_hypothesis(h, set(inside), labels) for h in found]
    entries.sort(key=lambda h: -(h["probability"] or 0.0))
    shown = [h for h in entries if h["inside"] or (h["probability"] or 0.0) >= _SHOWN]
    rest = [h for h in entries if h not in shown]
    weight = [h["probability"] for h in entries if h["inside"] and h["probability"] is not None]
    together = f", {percent(sum(weight))} together" if len(weight) > 1 else ""
    members = words.either(inside, labels)
    return {
        "shown": shown,
        "others": _others(rest) if rest else None,
        "shows": f"The smallest set with at least 95 % of the probability: {members}{together}. "
        "A line at the left marks it.",
    }


def _others(rest: list[dict[str, Any]]) -> Table:
    head = ["hypothesis", "probability", "survival", "change of χ²", "gap closed"]
    rows = [[h["name"], *(h["numbers"].get(name, DASH) for name in head[1:])] for h in rest]
    odds = percent(sum(h["probability"] or 0.0 for h in rest))
    plural = "hypothesis" if len(rest) == 1 else "hypotheses"
    return Table(f"{len(rest)} other {plural}, {odds} in all", head, rows)


def _hypothesis(h: dict, inside: set[str], labels: words.Labels) -> dict[str, Any]:
    name = str(h.get("name") or "?")
    numbers = {
        "probability": percent(h.get("probability")),
        "survival": number(h.get("survival"), 2),
        "change of χ²": number(h.get("delta_chi2"), sign=True),
        "gap closed": interval(h.get("closed_fraction")),
    }
    parameters = h.get("parameters") or {}
    return {
        "name": name,
        "said": words.title(words.describe_hypothesis(name, labels)),
        "inside": name in inside,
        "probability": finite(h.get("probability")),
        "percent": numbers["probability"],
        "sentence": words.sentence(str(h.get("sentence") or "")),
        "numbers": numbers,
        # What is known of this hypothesis, for the line under it.
        "known": [(k, v) for k, v in numbers.items() if v != DASH and k != "probability"],
        "parameters": [
            (str(key), with_error(p.get("value"), p.get("stderr"), str(p.get("unit") or "")))
            for key, p in parameters.items()
            if isinstance(p, dict)
        ],
    }
