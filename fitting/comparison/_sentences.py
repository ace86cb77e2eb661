"""A comparison in one or two sentences."""

from typing import TYPE_CHECKING

from fitting._units import quantity

from ._thresholds import THRESHOLDS

if TYPE_CHECKING:
    from ._comparison import Comparison
    from ._differences import GapChange

SEVERAL = "several"
_NAMED = 3  # parameters in the sentence; all are in the table
_LEAST_P = 1e-12  # smaller ones depend on tails that no one has seen


def describe_comparison(comparison: "Comparison") -> str:
    """What changed, by how much and how sure that is, in one or two sentences."""
    doubt = "" if comparison.trusted else " Not to be relied on: see the notes."
    what = (
        _describe_new_misfit(comparison),
        _describe_parameters(comparison),
        _describe_shared_misfit(comparison),
        _describe_effects(comparison),
        doubt,
    )
    return "".join(what).strip()


def _is_shared(misfit: "GapChange") -> bool:
    """Whether most of what the model leaves was there before and after."""
    least, most = sorted((misfit.before.value, misfit.after.value))
    return least > THRESHOLDS.shared_misfit * most


def _describe_shared_misfit(comparison: "Comparison") -> str:
    """Of a model that lacks something in both: what it leaves follows any change of the device."""
    misfit = comparison.misfit
    if not comparison.misfit_changed or misfit is None or not _is_shared(misfit):
        return ""
    one, two = (quantity(at.value, comparison.unit) for at in (misfit.before, misfit.after))
    return (
        f" The model lacks something in both recordings, and leaves {one} rms above noise before "
        f"and {two} after ({format_p(misfit.p_value)}): a change of what it lacks, or of "
        "what that makes of another change. `--effects` looks for the effect."
    )


def _describe_new_misfit(comparison: "Comparison") -> str:
    misfit = comparison.misfit
    if not comparison.misfit_changed or misfit is None or _is_shared(misfit):
        return ""
    one, two = (quantity(at.value, comparison.unit) for at in (misfit.before, misfit.after))
    larger = misfit.after.value > misfit.before.value
    more, where = ("larger", "after") if larger else ("smaller", "before")
    return (
        f"What no parameter of the model explains became {more}, {one} rms above noise before and "
        f"{two} after ({format_p(misfit.p_value)}): an effect that the model lacks is there "
        f"{where}, which `--effects` looks for. "
    )


def _describe_parameters(comparison: "Comparison") -> str:
    sure = format_p(comparison.p_change)
    if comparison.misfit_changed and not comparison.parameters_changed:
        shared = comparison.misfit is not None and _is_shared(comparison.misfit)
        return "No parameter is seen to have changed" + ("." if shared else " beside it.")
    if not comparison.changed:
        most = quantity(comparison.response.high, comparison.unit)
        return (
            f"Nothing changed that these recordings show ({sure}): over the same drives the "
            f"response differs by at most {most} rms."
        )
    size = f"the response by {_describe_response(comparison)}, {sure}"
    singles = [comparison[name] for name in comparison.set if name != SEVERAL]
    if not singles or comparison.set[0] == SEVERAL:
        moved = [p for p in comparison.parameters if p.p_holm < THRESHOLDS.change_level]
        if not moved:
            return f"The device changed ({size}), in several parameters that cannot be told."
        first = sorted(moved, key=lambda p: -abs(p.difference.value) / p.difference_stderr)[:_NAMED]
        named = "; ".join(f"{p.words} `{p.name}` {p.describe_share()}" for p in first)
        many = f"{len(moved)} of {len(comparison.parameters)}, "
        surest = "most surely " if len(moved) > len(first) else ""
        return f"Several parameters changed ({size}): {many}{surest}{named}."
    ways = "; or ".join(f"{p.words} `{p.name}` {p.describe(p.change)}" for p in singles[:_NAMED])
    more = ", perhaps others with it" if SEVERAL in comparison.set else ""
    if len(singles) == 1:
        return f"One parameter changed ({size}){more}: {ways}."
    rest = f"; or one of {len(singles) - _NAMED} others" if len(singles) > _NAMED else ""
    return f"One of these changed, which cannot be told apart ({size}){more}: {ways}{rest}."


def _describe_response(comparison: "Comparison") -> str:
    """How much the response changed, and at which drives most."""
    unit, response = comparison.unit, comparison.response
    if not response.low > 0.0:
        return f"at most {quantity(response.high, unit)} rms"
    text = f"{quantity(response.value, unit)} rms"
    drives = comparison.response_by_drive
    if len(drives) < 2:
        return text
    most = max(drives, key=lambda one: one["rms"])
    rates, swings = (len({one[key] for one in drives}) for key in ("excitation_hz", "amplitude"))
    where = []
    if rates > 1:
        rate = most["excitation_hz"]
        where.append("in the run without a rate" if rate is None else f"at {rate:g} Hz")
    if swings > 1:
        where.append(f"with {most['amplitude']:g} {comparison.drive_unit} peak to peak")
    return f"{text}, most {' '.join(where)} ({quantity(most['rms'], unit)})"


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
