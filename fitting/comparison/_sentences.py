"""A comparison in words: one sentence of what changed, then what else there is to know."""

import dataclasses
from typing import TYPE_CHECKING

from fitting._parameter_words import briefly
from fitting.report.comparison._sizes import Sizes, format_probability, format_range
from fitting.report.diagnosis._numbers import SPACE

from ._thresholds import THRESHOLDS

if TYPE_CHECKING:
    from ._comparison import Comparison
    from ._differences import EffectPresence, GapChange, Interval, ParameterDifference

SEVERAL = "several"
_NAMED = 3  # parameters in a sentence; all are in the table
_LEAST_P = 1e-12  # smaller ones depend on tails that no one has seen


def write_headline(comparison: "Comparison") -> str:
    """What changed and by how much, or that nothing did and what would have shown: a sentence."""
    doubt = (
        "" if comparison.trusted or comparison.failures else " (not to be relied on: see the notes)"
    )
    return f"{_say_what_changed(comparison)}{doubt}."


def list_details(comparison: "Comparison") -> list[str]:
    """The sentences below the headline, the most important first."""
    if comparison.failures:
        return [*comparison.failures[1:], *_detail_effects(comparison)]
    return [
        *_detail_misfit(comparison),
        *_detail_parameters(comparison),
        *_detail_response(comparison),
        *_detail_effects(comparison),
    ]


def _say_what_changed(comparison: "Comparison") -> str:
    misfit, alone = comparison.misfit, _of_one(comparison)
    if comparison.failures:
        return f"What changed is not known: {_uncapitalised(comparison.failures[0])[:-1]}"
    size = f"the response changed by {format_size(comparison, comparison.response)} rms"
    if alone:
        names = " and ".join(e.label for e in alone[:_NAMED])
        where = {e.only_in for e in alone}
        only = f"only {where.pop()}" if len(where) == 1 else "in one recording only"
        verb = "is" if len(alone) == 1 else "are"
        return f"{_capitalised(names)} {verb} there {only}: {size}"
    if comparison.misfit_changed and misfit is not None:
        left = (
            f"beyond noise its own fit leaves {format_size(comparison, misfit.before)} rms before "
            f"and {format_size(comparison, misfit.after)} after"
        )
        if _is_shared(misfit):
            return f"What the model lacks in both recordings changed: {left}"
        way = "came up" if _is_larger(misfit) else "went away"
        return f"An effect that the model lacks {way} between the recordings: {left}"
    if not comparison.changed:
        least = _value(comparison, comparison.detectable_response)
        percent = f"{100 * THRESHOLDS.detection_power:g} %"
        return (
            "Nothing changed that these recordings show: a change of any one parameter that "
            f"moves the response by {least} rms would have been found in {percent} of cases"
        )
    singles = _singles(comparison)
    if not singles:
        return f"Several parameters changed: {size}"
    more = ", perhaps others with it" if SEVERAL in comparison.set else ""
    if len(singles) == 1:
        (one,) = singles
        amount = one.describe_percent(one.change)
        return f"The {_called(one, brief=True)} changed by {amount}{more}"
    names = [_called(one, brief=True) if one.of_effect else f"`{one.name}`" for one in singles]
    listed = f"{', '.join(names[:-1])} and {names[-1]}"
    return f"One of {listed} changed{more}, which these recordings cannot tell apart: {size}"


def _of_one(comparison: "Comparison") -> "list[EffectPresence]":
    """The effects that one recording alone has."""
    return [e for e in comparison.effects or () if e.only_in]


def _called(one: "ParameterDifference", *, brief: bool = False) -> str:
    """A parameter in words, and by its letter in the equations, which those of effects have not."""
    words = briefly(one.words) if brief else one.words
    if one.of_effect:
        return words
    return f"{words} (`{one.name}`)" if brief else f"{words} `{one.name}`"


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
    sure = format_p(misfit.p_value)
    if alone := _of_one(comparison):
        return [
            f"With {_pronoun(alone)} in the model, what is left beyond noise still differs "
            f"({sure}): {format_size(comparison, misfit.before)} rms before, "
            f"{format_size(comparison, misfit.after)} after."
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
        if alone := _of_one(comparison):
            return [f"No other parameter is seen to have changed beside {_pronoun(alone)}."]
        if comparison.changed:
            return ["No parameter is seen to have changed beside it."]
        return [f"The test of no change gives {format_p(comparison.p_change)}."]
    singles = _singles(comparison)
    if singles:
        first = singles[:_NAMED]
        ways = "; or ".join(f"{_called(p)} {p.describe(p.change)}" for p in first)
        rest = len(singles) - len(first)
        more = f"; or one of {rest} others" if rest else ""
        return [f"If it alone changed: {ways}{more} ({sure})."]
    moved = [p for p in comparison.parameters if p.p_holm < THRESHOLDS.change_level]
    if not moved:
        return [f"Which ones cannot be told ({sure})."]
    first = sorted(moved, key=lambda p: -abs(p.difference.value) / p.difference_stderr)[:_NAMED]
    named = "; ".join(f"{_called(p)} {p.describe_share()}" for p in first)
    surest = "most surely " if len(moved) > len(first) else ""
    return [f"{len(moved)} of {len(comparison.parameters)} changed, {surest}{named} ({sure})."]


def _detail_response(comparison: "Comparison") -> list[str]:
    """How much the response changed, and at which drives most."""
    drives = comparison.response_by_drive
    size = format_size(comparison, comparison.response)
    text = f"Over the same drives the response differs by {size}"
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
    return [f"{text} rms, most {' '.join(where)} ({_value(comparison, most['rms'])})."]


def _detail_effects(comparison: "Comparison") -> list[str]:
    if comparison.effects is None:
        return []
    alone = _of_one(comparison)
    if not alone:
        return ["The same effects are named in both."] if comparison.effects else []
    return [_describe_effect(e, failed=bool(comparison.failures)) for e in alone]


def _describe_effect(effect: "EffectPresence", *, failed: bool) -> str:
    before, after = (
        format_probability(p) for p in (effect.before_probability, effect.after_probability)
    )
    text = (
        f"{_capitalised(effect.label)} is named only {effect.only_in}: its probability is {before} "
        f"before and {after} after."
    )
    if effect.sizes and not failed:
        first = effect.sizes[:_NAMED]
        known = "; ".join(
            f"{size.words} {format_range(dataclasses.asdict(size.interval), size.unit, sign=False)}"
            for size in first
        )
        text += f" Fitted to that recording: {known}."
    return text.replace(SPACE, " ")


def _pronoun(effects: "list[EffectPresence]") -> str:
    return "it" if len(effects) == 1 else "them"


def _capitalised(text: str) -> str:
    return text[:1].upper() + text[1:]


def _uncapitalised(text: str) -> str:
    return text[:1].lower() + text[1:]


def format_size(comparison: "Comparison", interval: "Interval") -> str:
    """A size with its interval, in the comparison's unit; a bound where it may be 0."""
    return _sizes(comparison).interval(dataclasses.asdict(interval)).replace(SPACE, " ")


def _value(comparison: "Comparison", size: float) -> str:
    return _sizes(comparison).value(size).replace(SPACE, " ")


def _sizes(comparison: "Comparison") -> Sizes:
    gaps = [gap for gap in (comparison.gap, comparison.misfit) if gap is not None]
    ends = [comparison.response, *(end for gap in gaps for end in (gap.before, gap.after))]
    rms = [one[key] for one in comparison.recordings for key in ("rmse", "rmse_joint")]
    return Sizes.of_sizes(comparison.unit, [*(end.high for end in ends), *rms])


def format_p(p: float) -> str:
    """A p-value in text."""
    return f"p = {p:.2g}" if p >= _LEAST_P else f"p < {_LEAST_P:.0e}"
