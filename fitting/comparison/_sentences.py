"""A comparison in one or two sentences."""

from typing import TYPE_CHECKING

from ._thresholds import THRESHOLDS

if TYPE_CHECKING:
    from ._comparison import Comparison

SEVERAL = "several"
_LEAST_P = 1e-12  # smaller ones depend on tails that no one has seen


def describe_comparison(comparison: "Comparison") -> str:
    """What changed, by how much and how sure that is, in one or two sentences."""
    doubt = "" if comparison.trusted else " Not to be relied on: see the notes."
    what = (
        _describe_misfit(comparison),
        _describe_parameters(comparison),
        _describe_effects(comparison),
        doubt,
    )
    return "".join(what).strip()


def _describe_misfit(comparison: "Comparison") -> str:
    misfit = comparison.misfit
    if not comparison.misfit_changed or misfit is None:
        return ""
    one, two = misfit.before, misfit.after
    more = "larger" if two.value > one.value else "smaller"
    where = "after" if two.value > one.value else "before"
    return (
        f"What no parameter of the model explains became {more}: {one.value:.2g} GHz rms above "
        f"noise before, {two.value:.2g} GHz after ({format_p(misfit.p_value)}): an effect "
        f"that the model lacks is there {where}, which `--effects` looks for. "
    ).replace("GHz", comparison.unit)


def _describe_parameters(comparison: "Comparison") -> str:
    sure = format_p(comparison.p_change)
    if comparison.misfit_changed and not comparison.parameters_changed:
        return "No parameter is seen to have changed beside it."
    if not comparison.changed:
        most = f"{comparison.response.high:.2g} {comparison.unit}"
        return (
            f"Nothing changed that these recordings show ({sure}): over the same drives the "
            f"response differs by at most {most} rms."
        )
    size = f"{comparison.response.value:.2g} {comparison.unit} rms over the same drives, {sure}"
    singles = [comparison[name] for name in comparison.set if name != SEVERAL]
    if not singles or comparison.set[0] == SEVERAL:
        moved = [p for p in comparison.parameters if p.p_holm < THRESHOLDS.change_level]
        if not moved:
            return f"The device changed ({size}), in several parameters that cannot be told."
        named = "; ".join(f"{p.words} `{p.name}` {p.describe(p.difference)}" for p in moved)
        return f"Several parameters changed ({size}): {named}."
    ways = "; or ".join(f"{p.words} `{p.name}` {p.describe(p.change)}" for p in singles)
    more = ", perhaps others with it" if SEVERAL in comparison.set else ""
    if len(singles) == 1:
        return f"One parameter changed ({size}){more}: {ways}."
    return f"One of these changed, which cannot be told apart ({size}){more}: {ways}."


def _describe_effects(comparison: "Comparison") -> str:
    if comparison.effects is None:
        return ""
    alone = [e for e in comparison.effects if e.only_in]
    if not alone:
        return " The same effects are named in both."
    return " " + " ".join(
        f"{e.label[:1].upper()}{e.label[1:]} is named only {e.only_in}." for e in alone
    )


def format_p(p: float) -> str:
    """A p-value in text."""
    return f"p = {p:.2g}" if p >= _LEAST_P else f"p < {_LEAST_P:.0e}"
