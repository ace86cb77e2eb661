"""A change of runs as a fault, in words."""

from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Recording

from ._change import Change
from ._law_cuts import rate_cuts

DIFFERS_WITH_RATE = "differs with rate"


def describe_change(recording: Recording, change: Change) -> Fault:
    """The change in words; of two groups the smaller one is named.

    Runs that are all of those above or below a rate may differ by a law of the device: another
    dependence of its hysteresis on rate, a lag, a resonance. Nothing in the data tells.
    """
    rows, size = change.rows, change.size
    others = tuple(i for i in range(len(recording.runs)) if i not in rows)
    if len(others) < len(rows):
        rows = others
        size = 1.0 / (1.0 + size) - 1.0 if change.kind in ("gain", "rate") else -size
    names = ", ".join(repr(recording.runs[i].name) for i in rows)
    y, u = recording.response_unit, recording.drive_unit
    text = {
        "offset": f"the readings lie {size:+.3g} {y} from where the other runs have them. If runs "
        'have no common zero, say `response_origin = "run"`',
        "gain": f"the readings are {1.0 + size:.4g} times as large as in the other runs: another "
        "device, scale or unit",
        "shift": f"the response comes {1e3 * abs(size):.3g} ms {'early' if size > 0 else 'late'} "
        "beside the other runs: a trigger or clock",
        "bias": f"the drive that fits the other runs is {size:+.3g} {u} from the one written: a "
        "bias written wrong",
        "rate": f"the run behaves as if its rate were {100 * size:+.3g} % from the one written: a "
        "wrong clock or rate, or the response of another run",
    }[change.kind]
    lawful = set(rows) in rate_cuts(recording) and (
        change.kind in ("shift", "rate")
        or (
            change.kind == "gain"
            and 1.0 / THRESHOLDS.lawful_gain < 1.0 + size < THRESHOLDS.lawful_gain
        )
    )
    those = "these runs" if rows[1:] else "this run"
    doubt = (
        " No other run has such a rate: it may be the device that differs there; record another."
    )
    return Fault(
        DIFFERS_WITH_RATE if lawful else "run does not belong",
        recording.runs[rows[0]].name,
        f"run{'s' * (len(rows) > 1)} {names}: {text}. That alone explains "
        f"{100 * min(change.explained, 1.0):.0f} % of what one model for all runs leaves. Correct "
        f"it, or leave {those} out.{doubt if lawful else ''}",
        tuple((0, recording.runs[i].drive.size - 1) for i in rows),
    )
