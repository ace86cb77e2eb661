"""The scan to take next where one answer stands beside `unlisted`: does it hold on other data?

`unlisted` predicts nothing, so no scan tells it from an effect by what either foresees. But a scan
inside what was recorded, of another waveform, asks nothing new of the hysteresis: what the effect
leaves there is something missing, or nothing.
"""

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._probability import UNLISTED
from rapi_jax import DriveLimits, Identified

from ._candidates import inside
from ._choice import NextScan, scan_length, scan_start


def needs_confirmation(names: list[str]) -> bool:
    """Whether a set of hypotheses is one answer beside `unlisted`."""
    return len(names) == 2 and UNLISTED in names


def confirmation_scan(
    whitened: WhitenedModel, names: list[str], limits: DriveLimits | None = None
) -> NextScan | None:
    """A sine inside what was recorded; `None` if the limits do not allow it.

    `names`: the set, see `is_alone`. `limits`: as in `next_scan`, and so are length and start.
    """
    recording = whitened.recording
    limits = Identified.of(recording).limits() if limits is None else limits
    samples, periods = scan_length(whitened)
    start = scan_start(recording)
    found = inside(recording, limits, samples=samples, periods=periods, start_s=start)
    if found is None:
        return None
    (name,) = (n for n in names if n != UNLISTED)
    said = name.replace("_", " ").replace("+", " and ")
    whole = "nothing is missing" if name == "none" else f"{said} is all there is"
    return NextScan(
        waveform=found.waveform,
        excitation_hz=found.excitation_hz,
        amplitude=found.amplitude,
        bias=found.bias,
        separates=[],
        power=0.0,
        pairs=[],
        candidates=[{**found.to_dict(), "power": 0.0, "checked": False}],
        reason=(
            f"{found.words(recording.drive_unit)}, inside what was recorded, asks nothing new of "
            f"the hysteresis: it shows whether {whole}."
        ),
        drive=found.drive,
    )
