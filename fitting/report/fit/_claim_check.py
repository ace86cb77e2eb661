"""The table of a claim that was checked, by rich."""

import math
from typing import TYPE_CHECKING

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from fitting._units import in_interval, quantity, readable_unit

from ._rows import format_number

if TYPE_CHECKING:
    from fitting.claim_check._check import Checked, ClaimCheck

_HEAD = {
    "prediction": "Error of the model, left as it is, in each run",
    "straightness": "Off a straight line in the middle 80 % of each branch",
}


def render_claim_check(check: "ClaimCheck") -> Group:
    """Whether a claim held: the answer, a row for each run or branch, and what to do."""
    colour = _colour(check)
    lines: list[Text | Table] = [_headline(check, colour), _tabulate(check)]
    reasons: dict[str, dict[str, None]] = {}
    for one in check.checked:
        for why in one.outside:
            reasons.setdefault(why, {})[repr(one.run)] = None
    lines += [
        Text(f"  - not judged: run{'s' * (len(runs) > 1)} {', '.join(runs)}: {why}.")
        for why, runs in reasons.items()
    ]
    spans = {one.run: (one.span, one.span_asked) for one in check.checked}
    lines += [
        Text(f"  - run {run!r} {_compare_spans(reached, asked, check.unit)}")
        for run, (reached, asked) in spans.items()
        if reached is not None and asked
    ]
    if check.offset is not None:
        zero = quantity(check.offset, check.unit)
        lines.append(
            Text(f"  - the model's zero less the recording's, no part of the claim: {zero}")
        )
    lines += [Text(f"  x {line}", style=colour) for line in check.advice]
    return Group(*lines)


def _colour(check: "ClaimCheck") -> str:
    if check.held is None:
        return "yellow"
    if not check.held:
        return "red"
    return "yellow" if any(one.within is False for one in check.checked) else "green"


def _headline(check: "ClaimCheck", colour: str) -> Text:
    """What was seen: how many are within the interval for one, and what that says of the claim."""
    judged = [one for one in check.checked if one.held is not None]
    beside = len(check.checked) - len(judged)
    above = [one for one in judged if not one.within]
    if not judged:
        return Text("Measured; nothing is claimed to compare it with.", style=f"bold {colour}")
    if check.held and above:
        most = quantity(max(one.bound for one in above), check.unit)
        left = f" ({beside} not judged)" if beside else ""
        return Text(
            f"The claim is not refuted: {len(above)} of {len(judged)} values exceed the 95 % "
            f"interval claimed for a single one{left}, but none exceeds {most}, the 97.5 % limit "
            f"for the largest of {len(judged)}.",
            style=f"bold {colour}",
        )
    words = "The claim held" if check.held else "The claim did NOT hold"
    head = Text(words, style=f"bold {colour}")
    return head.append(f" ({len(judged)} of {len(check.checked)} judged).", style="not bold")


def _tabulate(check: "ClaimCheck") -> Table:
    table = Table(title=_HEAD[check.kind], title_justify="left")
    left = ("run", "branch", "outcome")
    unit, factor = readable_unit(check.unit, [one.rms for one in check.checked])
    rms, noise, claimed = f"rms ({unit})", f"of it noise ({unit})", f"claim, 95 % ({unit})"
    swing = f"swing ({check.drive_unit})"
    names = ["run", "branch", "rate (Hz)", swing, rms, noise, claimed, "outcome"]
    if check.kind == "prediction":
        names.remove("branch")
    for name in names:
        table.add_column(name, justify="left" if name in left else "right")
    for one in check.checked:
        cells = {
            "run": escape(one.run),
            "branch": one.branch,
            "rate (Hz)": "-" if one.excitation_hz is None else f"{one.excitation_hz:g}",
            swing: format_number(one.swing, 3),
            rms: format_number(factor * one.rms, 3),
            noise: format_number(factor * one.noise, 3),
            claimed: "-"
            if math.isnan(one.high)
            else " to ".join(
                in_interval(factor * end, factor * (one.high - one.low))
                for end in (one.low, one.high)
            ),
            "outcome": _outcome(one),
        }
        table.add_row(*(cells[name] for name in names))
    return table


def _compare_spans(reached: float, asked: float, unit: str) -> str:
    """What a scan reached of the span that was asked for; nothing is claimed of it."""
    name, factor = readable_unit(unit, (asked,))
    off = 100.0 * (reached / asked - 1.0)
    share = f"{abs(off):.1f} % {'less' if off < 0 else 'more'}" if abs(off) >= 0.05 else "the same"
    return (
        f"spans {factor * reached:.4g} {name}, asked for were {factor * asked:.4g} {name}: {share} "
        "(the span is no part of the claim)"
    )


def _outcome(one: "Checked") -> str:
    if one.held is None:
        return "not judged"
    if not one.held:
        return "not held"
    if not one.within:
        return "above, not refuted"
    return "held" if one.rms >= one.low else "held, better than claimed"
