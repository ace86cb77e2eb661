"""The tables of a comparison, from the dictionary of `comparison.json`, as text."""

from typing import Any

from fitting._units import interval_digits, readable_unit
from fitting.report.diagnosis._numbers import (
    DASH,
    SPACE,
    finite_or_none,
    format_number,
    format_percent,
    format_quantity,
    format_with_error,
    unit_text,
)

_LEAST_P = 1e-12


def format_p(p: Any) -> str:
    """A p-value; very small ones as a bound."""
    x = finite_or_none(p)
    if x is None:
        return DASH
    return f"{x:.2g}" if x >= _LEAST_P else f"<{SPACE}{_LEAST_P:.0e}"


def state_p(p: Any) -> str:
    """`p = 0.03`, `p < 1e-12`: a p-value in a sentence."""
    text = format_p(p)
    return f"p{SPACE}{text}" if text.startswith("<") else f"p{SPACE}={SPACE}{text}"


def format_range(interval: dict[str, Any], unit: str) -> str:
    """`+0.05 (+0.04 to +0.06) GHz`."""
    value, low, high = (
        format_number(interval[key], digits, sign=True) for key, digits in _digits(interval).items()
    )
    end = "" if unit in ("", "1") else f"{SPACE}{unit_text(unit)}"
    return f"{value} ({low} to {high}){end}"


def format_change(interval: dict[str, Any], unit: str) -> str:
    """A change of the response, as `format_range`, in the unit that reads best."""
    unit, factor = _scale(interval, unit)
    return format_range({key: factor * interval[key] for key in interval}, unit)


def _scale(interval: dict[str, Any], unit: str) -> tuple[str, float]:
    ends = (finite_or_none(interval[key]) or 0.0 for key in ("value", "low", "high"))
    return readable_unit(unit, ends)


def format_size(interval: dict[str, Any], unit: str) -> str:
    """A size with its interval: `41 MHz (39 to 43)`; a bound where it may be 0."""
    unit, factor = _scale(interval, unit)
    interval = {key: factor * interval[key] for key in ("value", "low", "high")}
    if not finite_or_none(interval["low"]):
        return f"at most {format_quantity(interval['high'], unit)}"
    digits = _digits(interval)
    low, high = (format_number(interval[key], digits[key]) for key in ("low", "high"))
    value = format_quantity(interval["value"], unit, digits=digits["value"])
    return f"{value} ({low} to {high})"


def _digits(interval: dict[str, Any]) -> dict[str, int]:
    """The significant digits of the value and both ends, by the width between these."""
    value, low, high = (finite_or_none(interval[key]) for key in ("value", "low", "high"))
    width = 0.0 if low is None or high is None else high - low
    ends = {"value": value, "low": low, "high": high}
    return {key: interval_digits(end or 0.0, width) for key, end in ends.items()}


def format_size_of(value: Any, unit: str) -> str:
    """A number in a parameter's unit."""
    end = "" if unit in ("", "1") else f"{SPACE}{unit_text(unit)}"
    return f"{format_number(value, 2)}{end}"


def tabulate_parameters(content: dict[str, Any]) -> list[dict[str, Any]]:
    """A row per parameter: `name`, `words`, `cells`, whether `changed`, and `whisker` for a page.

    The whisker is the difference in standard errors with its interval, on one scale for all rows.
    """
    level, rows = content["level"], content["parameters"]
    singles = (
        [name for name in content["set"] if name in rows] if content["parameters_changed"] else []
    )
    scaled = {name: _scaled(row) for name, row in rows.items()}
    most = max(max(abs(x) for x in ends) for ends in scaled.values())
    out = []
    for name, row in rows.items():
        share = finite_or_none(row["percent"])
        percent = DASH if share is None else f"{format_number(share, 2, sign=True)}{SPACE}%"
        out.append(
            {
                "name": name,
                "words": row["words"],
                "changed": content["parameters_changed"]
                and (name in singles or row["p_holm"] < level),
                "cells": [
                    format_with_error(row["before"], row["before_stderr"], row["unit"]),
                    format_with_error(row["after"], row["after_stderr"], row["unit"]),
                    format_range(row["difference"], row["unit"]),
                    percent,
                    format_p(row["p_holm"]),
                    format_range(row["change"], row["unit"]),
                    format_p(row["p_given_others_holm"]),
                    format_percent(row["probability"]),
                    format_size_of(row["detectable"], row["unit"]),
                ],
                "whisker": dict(
                    zip(
                        ("value", "low", "high"),
                        (0.5 + 0.5 * end / most for end in scaled[name]),
                        strict=True,
                    )
                ),
            }
        )
    return out


def _scaled(row: dict[str, Any]) -> tuple[float, float, float]:
    error = row["difference_stderr"]
    return tuple(row["difference"][key] / error for key in ("value", "low", "high"))


ALONE = 5  # the first of the cells on a parameter that alone changed
HEADS = (
    "before",
    "after",
    "difference",
    "of before",
    "p",
    "if it alone changed",
    "p of that",
    "probability",
    "found from",
)


def tabulate_effects(content: dict[str, Any]) -> list[list[str]]:
    """Effect, probability before, after, and the recording that alone has it."""
    return [
        [
            e["label"],
            *(format_percent(e[f"{key}_probability"]) for key in ("before", "after")),
            f"only {e['only_in']}" if e["only_in"] else "in both",
        ]
        for e in content["effects"] or []
    ]


def list_facts(content: dict[str, Any]) -> list[tuple[str, str]]:
    """Figures of the comparison as a whole."""
    unit, gap = content["unit"], content["gap"]
    none, several = (content["probabilities"].get(name, 0.0) for name in ("none", "several"))
    facts = [
        ("Changed", "yes" if content["changed"] else "not shown"),
        ("p", f"{format_p(content['p_change'])} ({format_p(content['p_value'])} for all together)"),
        ("Response", f"{format_size(content['response_change'], unit)} rms"),
    ]
    if gap is not None:
        facts.append(("Gap before", f"{format_size(gap['before'], unit)} rms"))
        facts.append(("Gap after", f"{format_size(gap['after'], unit)} rms"))
    if (misfit := content["misfit"]) is not None:
        for key in ("before", "after"):
            facts.append((f"Own misfit {key}", f"{format_size(misfit[key], unit)} rms"))
    if gap is not None:
        facts.append(("Gap's change", format_change(gap["change"], unit)))
    for key, one in content["recordings"].items():
        own, both = (_rms(one[name], unit) for name in ("rmse", "rmse_joint"))
        text = f"{own} by its own model, {both} by one for both"
        facts.append((f"Rms {key}", text))
    facts.append(("Nothing changed", f"probability {format_percent(none)}"))
    facts.append(("Several did", f"probability {format_percent(several)}"))
    return facts


def _rms(value: float, unit: str) -> str:
    unit, factor = readable_unit(unit, (value,))
    return format_quantity(factor * value, unit)
