"""The table of a claim that was checked, by rich."""

from typing import TYPE_CHECKING

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from ._table import _format_number

if TYPE_CHECKING:
    from fitting.claim_check._check import Checked, ClaimCheck

_HEAD = {
    "prediction": "Error of the model, left as it is, in each run",
    "straightness": "Off a straight line in the middle 80 % of each branch",
}


def render_claim_check(check: "ClaimCheck") -> Group:
    """Whether a claim held: the answer, a row for each run or branch, and what to do."""
    colour, words = ("green", "The claim held") if check.held else ("red", "The claim did NOT hold")
    head = Text(words, style=f"bold {colour}")
    judged = sum(one.held is not None for one in check.checked)
    head.append(f" ({judged} of {len(check.checked)} judged).", style="not bold")
    lines: list[Text | Table] = [head, _tabulate(check)]
    reasons = dict.fromkeys(f"{o.run!r}: {why}" for o in check.checked for why in o.outside)
    lines += [Text(f"  - not judged: run {reason}.") for reason in reasons]
    if check.offset is not None:
        zero = f"{_format_number(check.offset, 2)} {check.unit}"
        lines.append(
            Text(f"  - the model's zero less the recording's, no part of the claim: {zero}")
        )
    lines += [Text(f"  x {line}", style=colour) for line in check.advice]
    return Group(*lines)


def _tabulate(check: "ClaimCheck") -> Table:
    table = Table(title=_HEAD[check.kind], title_justify="left")
    left = ("run", "branch", "outcome")
    rms, noise = f"rms ({check.unit})", f"of it noise ({check.unit})"
    swing = f"swing ({check.drive_unit})"
    names = ["run", "branch", "rate (Hz)", swing, rms, noise, "claimed (95 %)", "outcome"]
    if check.kind == "prediction":
        names.remove("branch")
    for name in names:
        table.add_column(name, justify="left" if name in left else "right")
    for one in check.checked:
        cells = {
            "run": escape(one.run),
            "branch": one.branch,
            "rate (Hz)": "-" if one.excitation_hz is None else f"{one.excitation_hz:g}",
            swing: _format_number(one.swing, 3),
            rms: _format_number(one.rms, 3),
            noise: _format_number(one.noise, 3),
            "claimed (95 %)": f"{_format_number(one.low, 3)} to {_format_number(one.high, 3)}",
            "outcome": _outcome(one),
        }
        table.add_row(*(cells[name] for name in names))
    return table


def _outcome(one: "Checked") -> str:
    if one.held is None:
        return "not judged"
    if not one.held:
        return "not held"
    if one.rms > one.high:
        return f"held: of so many one may reach {_format_number(one.bound, 3)}"
    return "held" if one.rms >= one.low else "held, better than claimed"
