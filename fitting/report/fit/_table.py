"""Tables of a fit, by rich: the same ones on a terminal, as text and as HTML."""

import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console, Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from fitting._units import in_interval, quantity, readable_unit, significant
from fitting.report._alike import fold_reasons, group_alike, wording
from fitting.report._plain_text import plain_text

from ._rows import Rows, describe_runs, describe_together, format_number, list_runs, list_starts

if TYPE_CHECKING:
    from fitting.identification._result import FitResult


def round_with_error(value: float, stderr: float) -> tuple[str, str]:
    """A value with as many digits as its standard error warrants, and the error with two."""
    if not np.isfinite(stderr) or stderr <= 0 or not np.isfinite(value):
        return f"{value:.6g}", "-" if stderr == 0 else "not determined"
    places = int(np.floor(np.log10(stderr))) - 1
    if -8 < places <= 0:
        return f"{value:z.{-places}f}", f"{stderr:.{-places}f}"
    digits = max(2, int(np.floor(np.log10(max(abs(value), stderr)))) - places + 1)
    # One far smaller than its error is 0 in those digits: 18 with an error of 98000 is.
    shown = float(np.round(value, -places)) + 0.0 if stderr > abs(value) else value
    if places > 0 and max(abs(value), stderr) < 1e6:
        return f"{np.round(value, -places) + 0.0:.0f}", f"{np.round(stderr, -places):.0f}"
    return f"{shown:.{digits}g}", f"{stderr:.2g}"


Ends = Mapping[str, tuple[float, float]]
ORIGIN = (
    "Runs have origins of their own here; that of a run left out is taken from its mean, so its "
    "shape alone is tested."
)
UNDETERMINED = "not determined by the rest"


def render_tables(result: "FitResult", intervals: Ends | None = None) -> Group:
    """The verdict, the parameters, the runs, and the held-out data, for a rich console.

    `intervals`: both ends of the 95 % interval of each parameter, where they are to be shown.
    """
    return Group(
        *_render_head(result),
        *(Text(f"  - {note}") for note in result.verdict.notes),
        *_render_parameters(result, intervals),
        _tabulate_runs(result),
        _tabulate_held_out(result),
        _tabulate_starts(result),
    )


def render_brief(
    result: "FitResult", intervals: Ends | None = None, *, notes: bool = True
) -> Group:
    """What a person reads first: the verdict, the first sentence of each note, the parameters.

    The rest is on the page and in `model.json`. `notes`: whether they are shown.
    """
    shown = fold_runs(result.verdict.notes) if notes else ()
    runs = describe_runs(result)
    return Group(
        *_render_head(result),
        *([Text(runs)] if runs else []),
        *(Text(f"  - {first_sentence(note)}") for note in shown),
        *_render_parameters(result, intervals),
    )


def _render_head(result: "FitResult") -> list[Text]:
    """The verdict, what speaks against the fit, and what was fitted."""
    return [
        render_verdict(result),
        *(Text(f"  x {reason}", style="red") for reason in fold_reasons(result.verdict.reasons)),
        Text(describe_model(result)),
    ]


def _render_parameters(result: "FitResult", intervals: Ends | None) -> list[Text | Table]:
    together = describe_together(result)
    table = _tabulate_parameters(result, intervals)
    return [table, *([Text(together)] if together else [])]


def fold_runs(notes: Sequence[str]) -> tuple[str, ...]:
    """Notes with those that say the same of several runs said once, of the first of them."""

    def kind(note: str) -> str:
        about = re.match(r"run '[^']*': (.*)", note)
        return note if about is None else wording(about[1])

    return tuple(
        same[0] if len(same) == 1 else f"{first_sentence(same[0])} ({len(same)} runs are alike.)"
        for same in group_alike(notes, kind)
    )


def fold_notes(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """The notes of several fits, by name of the recording: each kind once, and how many have it."""
    every = [note for found in notes.values() for note in found]
    return [
        f"{len(same)} of {len(notes)} recordings: {first_sentence(same[0])}"
        for same in group_alike(every, lambda note: note.split(":")[0])
    ]


def first_sentence(note: str) -> str:
    """A note up to its first full stop that ends a sentence."""
    return re.split(r"(?<=[.;])\s+(?=[A-Z`])", note, maxsplit=1)[0]


def render_verdict(result: "FitResult", scale: tuple[str, float] | None = None) -> Text:
    """Whether to trust the model, and what may be expected of it, as one sentence.

    `scale`: the unit of errors and the factor to it, by default that in which each reads best.
    """
    unit, claim, verdict = result.recording.response_unit, result.claim, result.verdict
    if not verdict.trusted:
        count = len(fold_reasons(verdict.reasons))
        why = "for this reason:" if count == 1 else f"for {count} reasons:"
        return Text(f"The model is NOT to be trusted, {why}", style="bold red")
    text = "The model can be trusted"
    if verdict.with_gap:
        text += f", though its residual of {_size(result.rmse, unit, scale)} rms exceeds the noise"
    if claim is None and verdict.with_gap:
        return Text(f"{text}.", style="bold green")
    if claim is None:
        return Text(f"{text}; it leaves {_size(result.rmse, unit, scale)} rms.", style="bold green")
    name, factor = scale or readable_unit(unit, (claim.rms,))
    width = factor * (claim.high - claim.low)
    rms, low, high, noise = (
        in_interval(factor * x, width) for x in (claim.rms, claim.low, claim.high, claim.noise)
    )
    if result.predicts_no_run:
        text = f"{text} at the rates and swings recorded, not between them"
    return Text(
        f"{text}: in another run it is expected to be off by {rms} {name} rms (95 % interval "
        f"{low} to {high}), which includes noise of {noise} {name} rms.",
        style="bold green",
    )


def _size(value: float, unit: str, scale: tuple[str, float] | None) -> str:
    if scale is None:
        return quantity(value, unit)
    name, factor = scale
    return f"{significant(factor * value, 3)} {name}"


def describe_model(result: "FitResult", scale: tuple[str, float] | None = None) -> str:
    """What was fitted and how closely, and where the claim holds; `scale` as in a verdict."""
    unit, claim = result.recording.response_unit, result.claim
    operator = result.ecdl.operator
    text = (
        f"{type(operator).__name__} with {operator.count} plays: rmse "
        f"{_size(result.rmse, unit, scale)}"
    )
    if np.isfinite(result.rmse_held_out):
        text += f", {_size(result.rmse_held_out, unit, scale)} on the last third, held out"
    text += f", loss {result.loss}." if result.loss != "squares" else "."
    if claim is None or not result.verdict.trusted:
        return text
    rates = _between(claim.rates_hz, "Hz")
    swings = _between(claim.swings, result.recording.drive_unit)
    if len(result.recording.amplitudes) > 1 and not result.swings_joined:
        each = " and ".join(format_number(swing) for swing in result.recording.amplitudes)
        swings = f"of {each} {result.recording.drive_unit} (none between: one did not predict "
        swings += "the other)"
    return (
        f"{text} The prediction holds for rates {rates}, swings {swings}, and conditions as over "
        f"the {_format_hours(claim.hours)} recorded."
    )


def _between(ends: tuple[float, float], unit: str) -> str:
    low, high = (format_number(end) for end in ends)
    return f"of {low} {unit}" if low == high else f"of {low} to {high} {unit}"


def _format_hours(hours: float) -> str:
    for size, unit in ((1.0, "h"), (60.0, "min"), (3600.0, "s")):
        if hours * size >= 1.0 or unit == "s":
            return f"{format_number(hours * size, 2)} {unit}"
    raise AssertionError("the last unit takes all")


def parameter_remark(p: Any) -> str:
    """What else is to know of an `Estimate` of a parameter."""
    if p.held:
        return "held"
    if p.at_bound:
        return "at a bound"
    return "error exceeds value" if np.isfinite(p.stderr) and p.stderr > abs(p.value) else ""


def _tabulate_parameters(result: "FitResult", intervals: Ends | None) -> Table:
    table = Table(title="Parameters", title_justify="left")
    shown = () if intervals is None else ("95 % interval",)
    for name in ("name", "value", "std. error", *shown, "unit", "remark"):
        table.add_column(name, justify="left" if name in ("name", "unit", "remark") else "right")
    for p in result.parameters:
        value, error = round_with_error(p.value, p.stderr)
        remark = parameter_remark(p)
        between = [] if intervals is None else [_format_ends(intervals.get(p.name), p.stderr)]
        unit = "" if p.unit == "1" else p.unit
        table.add_row(p.name, value, "" if p.held else error, *between, unit, remark)
    return table


def _format_ends(ends: tuple[float, float] | None, stderr: float) -> str:
    """Both ends with the digits that the standard error warrants; an open one is said."""
    if ends is None:
        return ""
    low, high = (round_with_error(end, stderr)[0] if np.isfinite(end) else "open" for end in ends)
    return f"{low} to {high}"


def _tabulate(title: str, content: Rows, right: Sequence[str]) -> Table:
    """A table of rows, with the columns named in `right` set to the right."""
    table = Table(title=title, title_justify="left")
    for name in content.heads:
        table.add_column(name, justify="right" if name in right else "left")
    for row in content.rows:
        table.add_row(*map(escape, row))
    return table


def _tabulate_runs(result: "FitResult") -> Table:
    content = list_runs(result)
    return _tabulate("Runs", content, content.heads[1:])


def _tabulate_held_out(result: "FitResult") -> Table:
    errors = held_out_sizes(result)
    unit, factor = readable_unit(result.recording.response_unit, errors)
    table = Table(title="Left out of the fit, then predicted", title_justify="left")
    if any(h.origin_from_data for h in result.held_out):
        table.caption, table.caption_justify = ORIGIN, "left"
    for name in (
        "left out",
        f"rmse ({unit})",
        f"std ({unit})",
        "% of span",
        f"fitted part ({unit})",
    ):
        table.add_column(name, justify="left" if name == "left out" else "right")
    for h in result.held_out:
        name = escape(h.scheme) + (" (origin from its mean)" if h.origin_from_data else "")
        shown = (factor * h.rmse, 4), (factor * h.std, 4), (100 * h.fraction, 3)
        cells = [format_number(*one) for one in shown] if h.determined else [UNDETERMINED, "", ""]
        table.add_row(name, *cells, format_number(factor * h.train_rmse))
    return table


def held_out_sizes(result: "FitResult") -> list[float]:
    """The errors, in the response's unit, that set the unit of a table of them."""
    predicted = [h.rmse for h in result.held_out if h.determined]
    return predicted or [h.train_rmse for h in result.held_out]


def _tabulate_starts(result: "FitResult") -> Table:
    table = _tabulate("Starts", list_starts(result), ("steps", "cost"))
    table.caption, table.caption_justify = result.describe_starts(), "left"
    return table


def render_text(result: "FitResult") -> str:
    """The tables as plain text."""
    return plain_text(render_tables(result))


def render_html(result: "FitResult") -> str:
    """The tables as an HTML fragment, for notebooks."""
    console = Console(
        file=io.StringIO(), record=True, width=110, highlight=False, force_jupyter=False
    )
    console.print(render_tables(result))
    return console.export_html(
        inline_styles=True, code_format='<pre style="line-height:1.25">{code}</pre>'
    )
