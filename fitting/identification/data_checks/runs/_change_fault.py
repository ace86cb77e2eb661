"""A change of runs as a fault, in words."""

import dataclasses

from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Recording

from ._change import Change
from ._law_cuts import rate_cuts, time_cuts

DIFFERS_WITH_RATE = "differs with rate"
DIFFERS_WITH_TIME = "differs with time"
LEFT_TO_EFFECTS = (DIFFERS_WITH_RATE, DIFFERS_WITH_TIME)  # the device may do it, too

_DOUBT = {
    DIFFERS_WITH_RATE: " No other run has such a rate: it may be the device that differs there; "
    "record another.",
    DIFFERS_WITH_TIME: " All other runs were recorded before or after: it may be a device that "
    "drifts; record such a run once more.",
}


def describe_change(recording: Recording, change: Change) -> Fault:
    """The change in words; of two groups the smaller one is named.

    Runs that are all of those above or below a rate may differ by a law of the device: another
    dependence of its hysteresis on rate, a lag, a resonance. Those before or after an instant may
    differ by a drift of its origin. One such change cannot tell.
    """
    rows, size = change.rows, change.size
    others = tuple(i for i in range(len(recording.runs)) if i not in rows)
    if len(others) < len(rows):
        rows = others
        size = 1.0 / (1.0 + size) - 1.0 if change.kind in ("gain", "rate") else -size
    names = ", ".join(repr(recording.runs[i].name) for i in rows)
    y, u = recording.response_unit, recording.drive_unit
    text = {
        "offset": f"the readings are offset by {size:+.3g} {y} from those of the other runs. "
        'If runs have no common zero, say `response_origin = "run"`',
        "gain": f"the readings are {1.0 + size:.4g} times as large as in the other runs: another "
        "device, scale or unit",
        "shift": f"the response comes {1e3 * abs(size):.3g} ms {'early' if size > 0 else 'late'} "
        "beside the other runs: a trigger or clock",
        "bias": f"to agree with the other runs the recorded drive must be shifted by {size:+.3g} "
        f"{u}: its bias is recorded wrongly",
        "rate": f"the run behaves as if its rate differed by {100 * size:+.3g} % from the one "
        "recorded: a wrong clock or rate, or the response of another run",
    }[change.kind]
    those = "these runs" if rows[1:] else "this run"
    kind = _kind(recording, dataclasses.replace(change, rows=rows, size=size))
    return Fault(
        kind,
        recording.runs[rows[0]].name,
        f"run{'s' * (len(rows) > 1)} {names}: {text}. That alone explains "
        f"{100 * min(change.explained, 1.0):.0f} % of the mean-square gap that one model for all "
        f"runs leaves. Correct it, or leave {those} out.{_DOUBT.get(kind, '')}",
        tuple((0, recording.runs[i].drive.size - 1) for i in rows),
    )


def describe_origins(recording: Recording, change: Change) -> Fault:
    """All runs with an origin of their own, in words; a device that drifts does that, too."""
    return Fault(
        DIFFERS_WITH_TIME,
        recording.runs[change.rows[0]].name,
        f"each run has a zero of its own, up to {change.size:.2g} {recording.response_unit} apart. "
        f"That explains {100 * min(change.explained, 1.0):.0f} % of what one model for all runs "
        'leaves. Say `response_origin = "run"`, unless it is the device that drifts from run to '
        "run.",
        tuple((0, recording.runs[i].drive.size - 1) for i in change.rows),
    )


def runs_apart_in_time(recording: Recording, fault: Fault) -> list[int]:
    """The runs that a fault of the kind `DIFFERS_WITH_TIME` is about."""
    names = [run.name for run in recording.runs]
    each = set(range(1, len(names)))  # has an origin of its own, the first that of the model
    return next(
        sorted(rows)
        for rows in (*time_cuts(recording), each)
        if names[min(rows)] == fault.run and len(rows) == len(fault.samples)
    )


def _kind(recording: Recording, change: Change) -> str:
    """Of which kind the fault is: whether rate or time may be what tells the runs apart."""
    rows, least = set(change.rows), 1.0 / THRESHOLDS.lawful_gain
    lawful_gain = change.kind == "gain" and least < 1.0 + change.size < THRESHOLDS.lawful_gain
    if rows in rate_cuts(recording) and (change.kind in ("shift", "rate") or lawful_gain):
        return DIFFERS_WITH_RATE
    if rows in time_cuts(recording) and change.kind == "offset":
        return DIFFERS_WITH_TIME
    return "run does not belong"
