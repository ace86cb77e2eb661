"""A checked recording on a terminal: its runs, its faults, what may be asked of it."""

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from fitting._units import quantity, readable_unit
from fitting.report._alike import fold_faults
from fitting.report._plain_text import plain_text
from fitting.report.fit._rows import format_number

if TYPE_CHECKING:
    from fitting.recording_check._check import RecordingCheck

_MARKS = {"yes": ("+", "green"), "partly": ("~", "yellow"), "no": ("x", "red")}


def render_recording_check(check: "RecordingCheck", name: str) -> Group:
    """The recording `name` in plain tables and sentences, for a rich console."""
    data = check.recording
    samples = sum(run.samples for run in check.runs)
    noise = f"{quantity(float(f'{check.noise:.2g}'), data.response_unit)} rms"
    if check.noise == 0.0 and (step := check.resolution) > 0.0:
        noise = f"below the reading's resolution of {quantity(step, data.response_unit)}"
    head = Text(f"{name}: ", style="bold")
    head.append(
        f"{len(check.runs)} run(s), {samples} samples; drive in {data.drive_unit}, response in "
        f"{data.response_unit}; noise {noise}",
        style="not bold",
    )
    rows: list[RenderableType] = [head, _tabulate(check)]
    rows += [Text(f"  x {line}", style="red") for line in fold_faults(check.faults)]
    rows += [Text(f"  - {note}") for note in check.notes]
    rows.append(Text("What may be asked of it:", style="bold"))
    for question in check.questions:
        mark, colour = _MARKS[question.answer]
        line = Text(f"  {mark} {question.name}: ", style=colour)
        line.append(f"{question.answer}; {question.because}", style="default")
        if question.record:
            line.append(f" {question.record}", style="bold default")
        rows.append(line)
    return Group(*rows)


def render_text(check: "RecordingCheck", name: str) -> str:
    """The same as plain text."""
    return plain_text(render_recording_check(check, name))


def _tabulate(check: "RecordingCheck") -> Table:
    drive, response = check.recording.drive_unit, check.recording.response_unit
    span, wide = readable_unit(response, (run.span for run in check.runs))
    noise, fine = readable_unit(response, (run.noise for run in check.runs))
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("run", overflow="fold", min_width=5)
    for head in (
        "rate\nHz", "periods", "samples", "sampling\nHz", f"swing\n{drive}", f"bias\n{drive}",
        f"span\n{span}", f"noise\n{noise}",
    ):  # fmt: skip
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("waveform", no_wrap=True)
    for run in check.runs:
        star = "" if run.noise_from == "periods" else "*"
        table.add_row(
            escape(run.name),
            "-" if run.excitation_hz is None else f"{run.excitation_hz:.6g}",
            str(run.periods) if run.periods else "-",
            str(run.samples),
            format_number(run.sample_hz, 6),
            format_number(run.swing),
            format_number(run.bias),
            format_number(wide * run.span),
            format_number(fine * run.noise, 2) + star,
            run.waveform,
        )
    if any(run.noise_from != "periods" for run in check.runs):
        table.caption = "* from sample to sample, since nothing repeats"
        table.caption_justify = "left"
    return table
