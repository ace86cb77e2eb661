"""What recordings, drives and scans are, in one line: for a prompt, a list or a debugger.

A drive and a run do not know their units, which are the recording's, so none is written.
"""

from typing import Any

from ._readable_unit import quantity, significant

_SHOWN = 4  # numbers of a list, in a line; of a longer one its two first and its last


def describe_drive(drive: Any) -> str:
    """`<Drive: triangle, 3 periods at 20 Hz, swing 4.5 about 3, 1500 samples>`."""
    return f"<Drive: {_drive(drive)}, {drive.size} samples>"


def describe_run(run: Any) -> str:
    """A drive as above, with the run's name and the span of its readings."""
    masked = int((~run.valid).sum())
    span = f"span {significant(run.span, 4)}" if masked < run.drive.size else "no reading"
    left_out = f", {masked} masked" if masked else ""
    return f"<Run {run.name!r}: {_drive(run.drive)}, {span}, {run.drive.size} samples{left_out}>"


def describe_recording(recording: Any) -> str:
    """`<Recording: 3 runs at 10, 20, 40 Hz, swing 4.5 V, response in GHz>`."""
    rates = [rate for rate in recording.rates if rate > 0]
    at = f" at {listed(rates)} Hz" if rates else " without a rate"
    swings = f"swing {listed(recording.amplitudes)} {recording.drive_unit}"
    return (
        f"<Recording: {_counted(len(recording.runs), 'run')}{at}, {swings}, response in "
        f"{recording.response_unit}>"
    )


def describe_target(target: Any) -> str:
    """`<Target: 60 GHz at 20 Hz, 8192 samples>`."""
    return f"<Target: {_scan(target)}, {target.time.size} samples>"


def describe_compensation(made: Any) -> str:
    """`<Compensation: 60 GHz at 20 Hz, drive 0.9 to 5.1 V, exact inverse, certified>`."""
    low, high = (significant(float(x), 4) for x in (made.drive.value.min(), made.drive.value.max()))
    word = "certified" if made.certificate.invertible else "not certified"
    notes = f", {_counted(len(made.notes), 'note')}" if made.notes else ""
    return (
        f"<Compensation: {_scan(made.target)}, drive {low} to {high} {made.drive_unit}, "
        f"{made.inverse} inverse, {word}{notes}>"
    )


def _drive(drive: Any) -> str:
    middle = float(drive.value.min() + drive.value.max()) / 2
    swing = f"swing {significant(drive.u_pp, 4)} about {significant(middle, 4)}"
    if drive.excitation_hz is None:
        return f"{drive.waveform}, not periodic, {significant(float(drive.time[-1]), 4)} s, {swing}"
    periods = f", {_counted(drive.periods, 'period')}" if drive.repeats else ""
    return f"{drive.waveform}{periods} at {significant(drive.rate, 4)} Hz, {swing}"


def _scan(target: Any) -> str:
    return f"{quantity(target.span, target.unit)} at {significant(target.excitation_hz, 4)} Hz"


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def listed(values: Any) -> str:
    """Numbers to four digits; of a long list the two first and the last."""
    texts = [significant(float(value), 4) for value in values]
    shown = texts if len(texts) <= _SHOWN else [*texts[:2], "...", texts[-1]]
    return ", ".join(shown)
