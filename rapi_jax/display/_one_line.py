"""What recordings, drives, scans and models are, in one line: for a prompt, a list or a debugger.

A drive and a run do not know their units, which are the recording's, so none is written.
"""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

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
    at = f" at {_listed(rates)} Hz" if rates else " without a rate"
    swings = f"swing {_listed(recording.amplitudes)} {recording.drive_unit}"
    return (
        f"<Recording: {_counted(len(recording.runs), 'run')}{at}, {swings}, response in "
        f"{recording.response_unit}>"
    )


def describe_target(target: Any) -> str:
    """`<Target: 60 GHz at 20 Hz, 8192 samples>`."""
    return f"<Target: {_scan(target)}, {target.time.size} samples>"


def describe_compensation(made: Any) -> str:
    """`<Compensation: 60 GHz at 20 Hz, drive 0.9 to 5.1, exact inverse, certified>`."""
    low, high = (significant(float(x), 4) for x in (made.drive.value.min(), made.drive.value.max()))
    word = "certified" if made.certificate.invertible else "not certified"
    notes = f", {_counted(len(made.notes), 'note')}" if made.notes else ""
    return (
        f"<Compensation: {_scan(made.target)}, drive {low} to {high}, {made.inverse} inverse, "
        f"{word}{notes}>"
    )


def describe_model(ecdl: Any, parameters: Sequence[Any]) -> str | None:
    """`<ECDL: RAPI of 10 plays, alpha=0.03, ...; Delay(tau=2e-05)>`.

    `None` of a model whose parameters are not numbers: traced, or a tree of something else.
    """
    parts: dict[Any, list[str]] = {"operator": []} | {k: [] for k in range(len(ecdl.effects))}
    for one in parameters:
        value: Any = ecdl
        for step in one.path:
            value = value[step] if isinstance(step, int) else getattr(value, step)
        if not isinstance(value, jax.Array | np.ndarray) or isinstance(value, jax.core.Tracer):
            return None
        place = one.path[0] if one.path[0] == "operator" else one.path[1]
        numbers = _listed(np.ravel(value)) if np.size(value) else ""
        text = f"[{numbers}]" if np.ndim(value) else numbers
        parts[place].append(f"{one.path[-1]}={text}")
    operator = f"{type(ecdl.operator).__name__} of {ecdl.operator.count} plays"
    around = [
        f"{type(effect).__name__}({', '.join(parts[k])})" for k, effect in enumerate(ecdl.effects)
    ]
    return f"<ECDL: {'; '.join([', '.join([operator, *parts['operator']]), *around])}>"


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


def _listed(values: Any) -> str:
    texts = [significant(float(value), 4) for value in values]
    shown = texts if len(texts) <= _SHOWN else [*texts[:2], "...", texts[-1]]
    return ", ".join(shown)
