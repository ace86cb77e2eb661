"""The ranked hypotheses with their probabilities, parameters and closed fractions."""

from typing import Any

from fitting.report.charts._figure import Table

from . import _text as words
from ._numbers import (
    DASH,
    UNDETERMINED,
    Scale,
    finite_or_none,
    format_interval,
    format_number,
    format_percent,
)

_FIELDS = {
    "hertz": "frequency", "at_hertz": "frequency",
    "third_sine": "third harmonic (sine)", "third_cosine": "third harmonic (cosine)",
}  # fmt: skip
_SHOWN_AT_LENGTH = 0.01  # less probable ones go to a table, unless in the 95 % credible set


def tabulate_hypotheses(
    diagnosis: dict, labels: words.Labels, scale: Scale
) -> dict[str, Any] | None:
    """The likely ones at length, the others as a table, and what the 95 % credible set is."""
    inside = words.credible_names(diagnosis["verdict"])
    found = [h for h in diagnosis.get("hypotheses") or [] if isinstance(h, dict)]
    if not found:
        return None
    entries = [_describe_entry(h, set(inside), labels, scale) for h in found]
    entries.sort(key=lambda h: -(h["probability"] or 0.0))
    shown = [h for h in entries if h["inside"] or (h["probability"] or 0.0) >= _SHOWN_AT_LENGTH]
    rest = [h for h in entries if h not in shown]
    weight = [h["probability"] for h in entries if h["inside"] and h["probability"] is not None]
    together = f", {format_percent(sum(weight))} together" if len(weight) > 1 else ""
    members = words.list_alternatives(inside, labels)
    return {
        "shown": shown,
        "others": _tabulate_others(rest) if rest else None,
        "shows": f"The 95 % credible set, the smallest with at least 95 % of the probability: "
        f"{members}{together}. A line on the left marks its members.",
    }


def _tabulate_others(rest: list[dict[str, Any]]) -> Table:
    head = ["hypothesis", "probability", "unabsorbed fraction", "reduction of χ²", "gap closed"]
    rows = [[h["title"], *(h["numbers"].get(name, DASH) for name in head[1:])] for h in rest]
    odds = format_percent(sum(h["probability"] or 0.0 for h in rest))
    plural = "hypothesis" if len(rest) == 1 else "hypotheses"
    return Table(f"{len(rest)} other {plural}, {odds} in all", head, rows)


def _describe_entry(
    h: dict, inside: set[str], labels: words.Labels, scale: Scale
) -> dict[str, Any]:
    name = str(h.get("name") or "?")
    numbers = {
        "probability": format_percent(h.get("probability")),
        "unabsorbed fraction": format_number(h.get("survival"), 2),
        "reduction of χ²": format_number(h.get("delta_chi2"), sign=True),
        "gap closed": format_interval(h.get("closed_fraction")),
    }
    shares = h.get("shares") or {}
    numbers |= {
        f"share of the gap, {words.without_article(words.describe_hypothesis(effect, labels))}": (
            format_percent(part)
        )
        for effect, part in shares.items()
    }
    parameters = (h.get("parameters") or {}) | (h.get("derived") or {})
    title = words.describe_hypothesis(name, labels)
    sentence = words.to_sentence(str(h.get("sentence") or ""))
    return {
        "name": name,
        "title": words.capitalise(title),
        "inside": name in inside,
        "probability": finite_or_none(h.get("probability")),
        "percent": numbers["probability"],
        "sentence": "" if sentence.rstrip(".").lower() == title.lower() else sentence,
        "numbers": numbers,
        # What is known of this hypothesis, for the line under it.
        "known": [(k, v) for k, v in numbers.items() if v != DASH and k != "probability"],
        "parameters": describe_parameters(parameters, scale),
    }


def describe_parameters(found: dict, scale: Scale) -> list[tuple[str, str]]:
    """Names and values with standard errors; those of the response in the page's unit.

    Names are without their effect's where there is one effect. What the recording does not
    determine is named together, in the end.
    """
    values = {str(key): p for key, p in found.items() if isinstance(p, dict)}
    one = len({key.partition(".")[0] for key in values}) == 1
    shown, open_ = [], []
    for key, p in values.items():
        name = (key.partition(".")[2] or key) if one else key.replace(".", " ")
        name = name_field(name)
        text = _describe_value(p, scale)
        if text == UNDETERMINED:
            open_.append(name)
        else:
            shown.append((name, text))
    return [*shown, (UNDETERMINED, ", ".join(open_))] if open_ else shown


def name_field(name: str) -> str:
    """A field of an effect in words, after the effect's name or alone, without its unit."""
    before, _, field = name.rpartition(" ")
    found = _FIELDS.get(field, field.removesuffix("_s"))
    return f"{before} {found}".strip().replace("_", " ")


def _describe_value(p: dict, scale: Scale) -> str:
    return scale.with_error(p.get("value"), p.get("stderr"), str(p.get("unit") or ""))
