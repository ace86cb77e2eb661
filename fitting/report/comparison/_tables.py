"""The tables of a comparison, from the dictionary of `comparison.json`, as text."""

from typing import Any

from fitting.report.diagnosis._numbers import (
    DASH,
    SPACE,
    Scale,
    finite_or_none,
    format_number,
    format_quantity,
    format_with_error,
)

from ._sizes import Sizes, format_probability, format_range

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


def format_size_of(value: Any, unit: str) -> str:
    """A number in a parameter's unit, in that in which it reads best."""
    scale = Scale.of(unit, [value])
    return format_quantity(scale.value(value), scale.unit, digits=2)


def tabulate_parameters(content: dict[str, Any]) -> list[dict[str, Any]]:
    """A row per parameter: `name`, `words`, `cells`, whether `changed`, and `whisker` for a page.

    `code`: its letter in the equations, which those of effects have not.
    The whisker is the difference in standard errors with its interval, on one scale for all rows.
    """
    level, rows = content["level"], content["parameters"]
    singles = (
        [name for name in content["set"] if name in rows] if content["parameters_changed"] else []
    )
    scaled = {name: _scaled(row) for name, row in rows.items()}
    most = max((abs(x) for ends in scaled.values() for x in ends), default=1.0)
    out = []
    for name, row in rows.items():
        share = finite_or_none(row["percent"])
        percent = DASH if share is None else f"{format_number(share, 2, sign=True)}{SPACE}%"
        out.append(
            {
                "name": name,
                "words": row["words"],
                "code": "" if "." in name else name,
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
                    format_probability(row["probability"]),
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
            *(format_probability(e[f"{key}_probability"]) for key in ("before", "after")),
            f"only {e['only_in']}" if e["only_in"] else "in both",
        ]
        for e in content["effects"] or []
    ]


def tabulate_sizes(content: dict[str, Any]) -> list[list[str]]:
    """Parameters of the effects that one recording alone has: which, and the estimate there."""
    return [
        [size["words"], e["only_in"], format_range(size["interval"], size["unit"], sign=False)]
        for e in content["effects"] or []
        for size in ([] if content["failures"] else e["sizes"])
    ]


def list_facts(content: dict[str, Any]) -> list[tuple[str, str]]:
    """The figures that a reader asks for first: whether, how much, how sure, and what is left."""
    sizes, several = Sizes.of(content), content["probabilities"].get("several", 0.0)
    if content["failures"]:
        return [("Changed", "not known"), *_list_left(content, sizes, ("gap",))]
    none = content["probabilities"].get("none", 0.0)
    likely = f"unchanged: probability {format_probability(none)}; several changed: "
    return [
        ("Changed", "yes" if content["changed"] else "not shown"),
        ("Response", f"{sizes.interval(content['response_change'])} rms"),
        ("p", f"{format_p(content['p_change'])} ({format_p(content['p_value'])} for parameters)"),
        ("Parameters", f"{likely}{format_probability(several)}"),
        *_list_left(content, sizes, ("gap", "misfit")),
    ]


def list_fits(content: dict[str, Any]) -> list[tuple[str, str]]:
    """What the fits leave of each recording, for those who ask further."""
    sizes = Sizes.of(content)
    out = []
    for key, one in content["recordings"].items():
        own, both = (sizes.value(one[name]) for name in ("rmse", "rmse_joint"))
        out.append((f"Rms {key}", f"{own} by its own model, {both} by one for both"))
    return out


def _list_left(
    content: dict[str, Any], sizes: Sizes, which: tuple[str, ...]
) -> list[tuple[str, str]]:
    """What a model leaves above noise, before and after: of one model, and of the own of each."""
    names = {"gap": "Gap", "misfit": "Own misfit"}
    out = []
    for key in which:
        if (left := content[key]) is not None:
            before, after = (sizes.interval(left[label]) for label in ("before", "after"))
            out.append((names[key], f"{before} before, {after} after, rms"))
    return out
