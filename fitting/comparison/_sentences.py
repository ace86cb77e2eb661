"""A comparison in words: one sentence of what changed, then what else there is to know."""

from typing import TYPE_CHECKING

from fitting._parameter_words import briefly
from fitting._units import quantity, readable_unit

from ._thresholds import THRESHOLDS

if TYPE_CHECKING:
    from ._comparison import Comparison
    from ._differences import GapChange, Interval

SEVERAL = "several"
_NAMED = 3  # parameters in a sentence; all are in the table
_LEAST_P = 1e-12  # smaller ones depend on tails that no one has seen


def write_headline(comparison: "Comparison") -> str:
    """What changed and by how much, or that nothing did and what would have shown: a sentence."""
    doubt = "" if comparison.trusted else " (not to be relied on: see the notes)"
    return f"{_say_what_changed(comparison)}{doubt}."


def list_details(comparison: "Comparison") -> list[str]:
    """The sentences below the headline, the most important first."""
    return [
        *_detail_misfit(comparison),
        *_detail_parameters(comparison),
        *_detail_response(comparison),
        *_detail_effects(comparison),
    ]


def _say_what_changed(comparison: "Comparison") -> str:
    unit, misfit = comparison.unit, comparison.misfit
    alone = [e for e in comparison.effects or () if e.only_in]
    if alone:
        names = " and ".join(e.label for e in alone[:_NAMED])
        where = {e.only_in for e in alone}
        only = f"only {where.pop()}" if len(where) == 1 else "in one recording only"
        verb = "is" if len(alone) == 1 else "are"
        size = f"the response changed by {format_size(comparison.response, unit)} rms"
        return f"{names[:1].upper()}{names[1:]} {verb} there {only}: {size}"
    if comparison.misfit_changed and misfit is not None:
        left = (
            f"beyond noise its own fit leaves {format_size(misfit.before, unit)} rms before and "
            f"{format_size(misfit.after, unit)} after"
        )
        if _is_shared(misfit):
            return f"What the model lacks in both recordings changed: {left}"
        way = "came up" if _is_larger(misfit) else "went away"
        return f"An effect that the model lacks {way} between the recordings: {left}"
    if not comparison.changed:
        least = quantity(comparison.detectable_response, unit)
        percent = f"{100 * THRESHOLDS.detection_power:g} %"
        return (
            "Nothing changed that these recordings show: a change of any one parameter that "
            f"moves the response by {least} rms would have been found in {percent} of cases"
        )
    size = f"the response changed by {format_size(comparison.response, unit)} rms"
    singles = _singles(comparison)
    if not singles:
        return f"Several parameters changed: {size}"
    more = ", perhaps others with it" if SEVERAL in comparison.set else ""
    if len(singles) == 1:
        (one,) = singles
        amount = one.describe_percent(one.change)
        return f"The {briefly(one.words)} (`{one.name}`) changed by {amount}{more}"
    names = [f"`{one.name}`" for one in singles]
    listed = f"{', '.join(names[:-1])} and {names[-1]}"
    return f"One of {listed} changed{more}, which these recordings cannot tell apart: {size}"


def _singles(comparison: "Comparison") -> list:
    """The parameters of which one alone may have changed; none where several did."""
    if comparison.set[:1] == (SEVERAL,):
        return []
    return [comparison[name] for name in comparison.set if name != SEVERAL]


def _is_shared(misfit: "GapChange") -> bool:
    """Whether most of what the model leaves was there before and after."""
    least, most = sorted((misfit.before.value, misfit.after.value))
    return least > THRESHOLDS.shared_misfit * most


def _is_larger(misfit: "GapChange") -> bool:
    return misfit.after.value > misfit.before.value


def _detail_misfit(comparison: "Comparison") -> list[str]:
    misfit = comparison.misfit
    if not comparison.misfit_changed or misfit is None:
        return []
    sure, unit = format_p(misfit.p_value), comparison.unit
    if comparison.effects and any(e.only_in for e in comparison.effects):
        return [
            f"With it in the model, what is left beyond noise still differs ({sure}): "
            f"{format_size(misfit.before, unit)} rms before, {format_size(misfit.after, unit)} "
            "after."
        ]
    look = "" if comparison.effects is not None else " `--effects` looks for the effect."
    if _is_shared(misfit):
        return [
            f"The model lacks something in both recordings ({sure} for no change of it): it "
            f"changed itself, or follows another change of the device.{look}"
        ]
    return [f"No parameter of the model explains this ({sure} for no change of it).{look}"]


def _detail_parameters(comparison: "Comparison") -> list[str]:
    sure = f"{format_p(comparison.p_change)} for no change"
    if not comparison.parameters_changed:
        if comparison.changed:
            return ["No parameter is seen to have changed beside it."]
        return [f"The test of no change gives {format_p(comparison.p_change)}."]
    singles = _singles(comparison)
    if singles:
        first = singles[:_NAMED]
        ways = "; or ".join(f"{p.words} `{p.name}` {p.describe(p.change)}" for p in first)
        rest = len(singles) - len(first)
        more = f"; or one of {rest} others" if rest else ""
        return [f"If it alone changed: {ways}{more} ({sure})."]
    moved = [p for p in comparison.parameters if p.p_holm < THRESHOLDS.change_level]
    if not moved:
        return [f"Which ones cannot be told ({sure})."]
    first = sorted(moved, key=lambda p: -abs(p.difference.value) / p.difference_stderr)[:_NAMED]
    named = "; ".join(f"{p.words} `{p.name}` {p.describe_share()}" for p in first)
    surest = "most surely " if len(moved) > len(first) else ""
    return [f"{len(moved)} of {len(comparison.parameters)} changed, {surest}{named} ({sure})."]


def _detail_response(comparison: "Comparison") -> list[str]:
    """How much the response changed, and at which drives most."""
    unit, drives = comparison.unit, comparison.response_by_drive
    text = f"Over the same drives the response differs by {format_size(comparison.response, unit)}"
    if not comparison.response.low > 0.0 or len(drives) < 2:
        return [f"{text} rms."]
    most = max(drives, key=lambda one: one["rms"])
    rates, swings = (len({one[key] for one in drives}) for key in ("excitation_hz", "amplitude"))
    where = []
    if rates > 1:
        rate = most["excitation_hz"]
        where.append("in the run without a rate" if rate is None else f"at {rate:g} Hz")
    if swings > 1:
        where.append(f"with {most['amplitude']:g} {comparison.drive_unit} peak to peak")
    return [f"{text} rms, most {' '.join(where)} ({quantity(most['rms'], unit)})."]


def _detail_effects(comparison: "Comparison") -> list[str]:
    if comparison.effects is None:
        return []
    if not any(e.only_in for e in comparison.effects):
        return ["The same effects are named in both."]
    return [
        f"{e.label[:1].upper()}{e.label[1:]} is named only {e.only_in}: its probability is "
        f"{_percent(e.before_probability)} before and {_percent(e.after_probability)} after."
        for e in comparison.effects
        if e.only_in
    ]


def format_size(interval: "Interval", unit: str) -> str:
    """A size with its interval: `41 MHz (39 to 43)`; a bound where it may be 0."""
    if not interval.low > 0.0:
        return f"at most {quantity(interval.high, unit)}"
    ends = interval.low, interval.high
    _, factor = readable_unit(unit, (interval.value, *ends))
    low, high = (f"{factor * end:.3g}" for end in ends)
    return f"{quantity(interval.value, unit)} ({low} to {high})"


def _percent(probability: float) -> str:
    """A probability, of which neither 0 nor 100 % can be known."""
    if probability < 0.001:
        return "under 0.1 %"
    return "over 99.9 %" if probability > 0.999 else f"{100 * probability:.3g} %"


def format_p(p: float) -> str:
    """A p-value in text."""
    return f"p = {p:.2g}" if p >= _LEAST_P else f"p < {_LEAST_P:.0e}"
