"""Tables of a fit, by rich: the same ones on a terminal, as text and as HTML."""

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from fitting.identification._result import FitResult


def _format_number(value: float, digits: int = 4) -> str:
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}g}"


def round_with_error(value: float, stderr: float) -> tuple[str, str]:
    """A value with as many digits as its standard error warrants, and the error with two."""
    if not np.isfinite(stderr) or stderr <= 0 or not np.isfinite(value):
        return f"{value:.6g}", "-" if stderr == 0 else "not fixed"
    places = int(np.floor(np.log10(stderr))) - 1
    if -8 < places <= 0:
        return f"{value:.{-places}f}", f"{stderr:.{-places}f}"
    digits = max(2, int(np.floor(np.log10(max(abs(value), stderr)))) - places + 1)
    return f"{value:.{digits}g}", f"{stderr:.2g}"


Ends = Mapping[str, tuple[float, float]]


def render_tables(result: "FitResult", intervals: Ends | None = None) -> Group:
    """The verdict, the parameters, the runs, and the held-out data, for a rich console.

    `intervals`: both ends of the 95 % interval of each parameter, where they are to be shown.
    """
    unit = result.recording.response_unit
    colour, word = ("green", "trusted") if result.verdict.trusted else ("red", "NOT to be trusted")
    head = Text(f"{type(result.ecdl.operator).__name__} with {result.ecdl.operator.count} plays: ")
    head.append(word, style=f"bold {colour}")
    head.append(f"   rmse {_format_number(result.rmse)} {unit}")
    if np.isfinite(result.rmse_held_out):
        head.append(f", held out {_format_number(result.rmse_held_out)} {unit}")
    if result.loss != "squares":
        head.append(f", loss {result.loss}")
    lines: list[Text | Table] = [head]
    if result.verdict.trusted:
        lines += [Text(f"  {line}") for line in _claim_lines(result)]
    for reason in result.verdict.reasons:
        lines.append(Text(f"  x {reason}", style=colour))
    for note in result.verdict.notes:
        lines.append(Text(f"  - {note}"))
    return Group(
        *lines,
        _tabulate_parameters(result, intervals),
        _tabulate_runs(result),
        _tabulate_held_out(result),
        _tabulate_starts(result),
    )


def _claim_lines(result: "FitResult") -> list[str]:
    """The claim in words, where there is one."""
    claim = result.claim
    if claim is None:
        return []
    unit, number = result.recording.response_unit, _format_number

    def between(ends: tuple[float, float], unit: str) -> str:
        low, high = (number(end) for end in ends)
        return f"at {low} {unit}" if low == high else f"from {low} to {high} {unit}"

    swings = between(claim.swings, result.recording.drive_unit)
    return [
        f"predicts another run within {number(claim.rms, 2)} {unit} rms ({number(claim.low, 2)} to "
        f"{number(claim.high, 2)} in 95 %), noise of {number(claim.noise, 2)} included, "
        f"{between(claim.rates_hz, 'Hz')}, swings {swings}, as over the {number(claim.hours, 2)} h "
        "recorded."
    ]


def _tabulate_parameters(result: "FitResult", intervals: Ends | None) -> Table:
    table = Table(title="Parameters", title_justify="left")
    shown = () if intervals is None else ("95 % interval",)
    for name in ("name", "value", "std. error", *shown, "unit", "remark"):
        table.add_column(name, justify="left" if name in ("name", "unit", "remark") else "right")
    for p in result.parameters:
        value, error = round_with_error(p.value, p.stderr)
        remark = "held" if p.held else "at a bound" if p.at_bound else ""
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


def _tabulate_runs(result: "FitResult") -> Table:
    unit = result.recording.response_unit
    table = Table(title="Runs", title_justify="left")
    heads = (
        "run",
        "rate (Hz)",
        "periods",
        "loop (%)",
        "weight",
        f"rmse ({unit})",
        "% of span",
        "rho",
    )
    for name in heads:
        table.add_column(name, justify="left" if name == "run" else "right")
    for run in result.runs:
        table.add_row(
            escape(run.name),
            _format_number(run.excitation_hz) if run.excitation_hz else "-",
            str(run.periods),
            _format_number(100 * run.hysteresis, 3),
            _format_number(run.weight, 3),
            _format_number(run.rmse),
            _format_number(100 * run.rmse_fraction, 3),
            _format_number(run.rho, 3),
        )
    return table


def _tabulate_held_out(result: "FitResult") -> Table:
    unit = result.recording.response_unit
    table = Table(title="Left out of the fit, then predicted", title_justify="left")
    for name in (
        "left out",
        f"rmse ({unit})",
        f"std ({unit})",
        "% of span",
        f"fitted part ({unit})",
    ):
        table.add_column(name, justify="left" if name == "left out" else "right")
    for h in result.held_out:
        name = escape(h.scheme) + (" (own origin)" if h.origin_from_data else "")
        table.add_row(
            name,
            _format_number(h.rmse),
            _format_number(h.std),
            _format_number(100 * h.fraction, 3),
            _format_number(h.train_rmse),
        )
    return table


def _tabulate_starts(result: "FitResult") -> Table:
    table = Table(title="Starts", title_justify="left")
    for name in ("start", "steps", "cost", "end"):
        table.add_column(name, justify="right" if name in ("steps", "cost") else "left")
    for start in result.starts:
        table.add_row(
            start.origin,
            str(start.steps),
            _format_number(start.cost, 7),
            "best" if start.agrees else "elsewhere",
        )
    return table


def render_text(result: "FitResult") -> str:
    """The tables as plain text."""
    buffer = io.StringIO()
    # Without `force_jupyter` rich would show it in a notebook's cell and leave the text empty.
    console = Console(
        file=buffer, width=110, color_system=None, highlight=False, force_jupyter=False
    )
    console.print(render_tables(result))
    return buffer.getvalue()


def render_html(result: "FitResult") -> str:
    """The tables as an HTML fragment, for notebooks."""
    console = Console(
        file=io.StringIO(), record=True, width=110, highlight=False, force_jupyter=False
    )
    console.print(render_tables(result))
    return console.export_html(
        inline_styles=True, code_format='<pre style="line-height:1.25">{code}</pre>'
    )
