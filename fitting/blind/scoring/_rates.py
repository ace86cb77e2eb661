"""Rates of verdicts: detection, false alarms, unlisted effects, coverage of credible sets.

`verdict_of` of each function gives the verdict to score: the diagnosis', or a baseline's.
"""

from collections.abc import Callable, Sequence
from typing import Any

from fitting.blind.protocol._verdict_names import FAILED, NONE, UNLISTED

from ._outcome import Outcome
from ._thresholds import THRESHOLDS
from ._wilson import compare_with_target, proportion

LISTED = ("listed", "form", "pair")
VerdictOf = Callable[[Outcome], str | None]


def diagnosis_verdict(entry: Outcome) -> str | None:
    """The diagnosis' verdict."""
    return entry.verdict


def detection_rate(
    entries: Sequence[Outcome], verdict_of: VerdictOf = diagnosis_verdict
) -> dict[str, Any]:
    """Devices with an effect of 2 sigma or more in which something was found."""
    judged = [
        e
        for e in entries
        if not e.is_null and e.size >= THRESHOLDS.detectable and verdict_of(e) is not None
    ]
    return proportion(
        sum(verdict_of(e) not in (NONE, FAILED) for e in judged),
        len(judged),
        least=THRESHOLDS.detection_target,
    )


def false_alarm_rate(
    entries: Sequence[Outcome],
    verdict_of: VerdictOf = diagnosis_verdict,
    *,
    base_misfit: bool | None = None,
) -> dict[str, Any]:
    """Nulls in which something was found: of all, or of those with or without base misfit."""
    nulls = [e for e in entries if e.is_null and verdict_of(e) is not None]
    if base_misfit is not None:
        nulls = [e for e in nulls if e.base_misfit == base_misfit]
    return proportion(
        sum(verdict_of(e) != NONE for e in nulls), len(nulls), most=THRESHOLDS.false_alarm_target
    )


def unlisted_rate(
    entries: Sequence[Outcome], verdict_of: VerdictOf = diagnosis_verdict
) -> dict[str, Any]:
    """Devices with an unlisted effect of 4 sigma or more whose verdict is `unlisted`."""
    large = [e for e in entries if e.kind == "unlisted" and e.is_nameable]
    large = [e for e in large if verdict_of(e) is not None]
    return proportion(
        sum(verdict_of(e) == UNLISTED for e in large), len(large), least=THRESHOLDS.unlisted_target
    )


def unlisted_set_rate(entries: Sequence[Outcome]) -> dict[str, Any]:
    """The same where the credible set holds it."""
    large = [e for e in entries if e.kind == "unlisted" and e.is_nameable]
    return proportion(sum(UNLISTED in e.credible_set for e in large), len(large))


def listed_refusal_rate(
    entries: Sequence[Outcome], verdict_of: VerdictOf = diagnosis_verdict
) -> dict[str, Any]:
    """Devices with listed effects of 4 sigma or more that were called unlisted.

    Of two each has to be detectable.
    """
    large = [e for e in entries if e.kind in LISTED and e.is_nameable and verdict_of(e) is not None]
    return proportion(
        sum(verdict_of(e) in (UNLISTED, FAILED) for e in large),
        len(large),
        most=THRESHOLDS.refusal_target,
    )


def set_coverage(entries: Sequence[Outcome]) -> dict[str, Any]:
    """How often the credible set holds the right answer, and how many names it has."""
    held = sum(e.correct in e.credible_set for e in entries)
    sizes = [len(e.credible_set) for e in entries if e.error is None]
    mean = sum(sizes) / len(sizes) if sizes else None
    return {
        "coverage": proportion(held, len(entries), least=THRESHOLDS.coverage_target),
        "mean_size": compare_with_target(mean, len(sizes), most=THRESHOLDS.set_size_target),
    }


def withheld_rates(entries: Sequence[Outcome]) -> dict[str, Any]:
    """Devices whose effect was not among the candidates: the right answer is unlisted."""
    names = sorted({str(e.withheld) for e in entries})
    return {
        "all": _unlisted_share(entries),
        "in_set": proportion(sum(UNLISTED in e.credible_set for e in entries), len(entries)),
        "by_effect": {
            name: _unlisted_share([e for e in entries if e.withheld == name]) for name in names
        },
    }


def _unlisted_share(entries: Sequence[Outcome]) -> dict[str, Any]:
    return proportion(
        sum(e.verdict == UNLISTED for e in entries), len(entries), least=THRESHOLDS.unlisted_target
    )


def run_times(entries: Sequence[Outcome]) -> dict[str, Any]:
    """How long a diagnosis took, s: median, nine of ten, longest."""
    taken = sorted(float(e.diagnosis["seconds"]) for e in entries if "seconds" in e.diagnosis)
    if not taken:
        return {"n": 0, "median": None, "most_of_ten": None, "longest": None}
    return {
        "n": len(taken),
        "median": quantile(taken, 0.5),
        "most_of_ten": quantile(taken, 0.9),
        "longest": taken[-1],
    }


def quantile(ordered: Sequence[float], part: float) -> float:
    """By straight lines between the values, which must be in order."""
    at = part * (len(ordered) - 1)
    low = int(at)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (at - low) * (ordered[high] - ordered[low])
