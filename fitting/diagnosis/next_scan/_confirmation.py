"""The scan that confirms one hypothesis which stands alone beside `unlisted`.

`unlisted` predicts nothing, so no scan separates it from an effect by their predictions. But a scan
inside what was recorded, of another waveform, needs no extrapolation of the hysteresis: what the
effect leaves there is something missing, or nothing.
"""

from fitting.diagnosis._text import effect_labels
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which.evidence._probability import UNLISTED
from fitting.report.diagnosis._text import describe_hypothesis
from rapi_jax import DriveLimits, Identified
from rapi_jax.effects import ALL

from ._candidates import make_inner_sine
from ._choice import NextScan, scan_length, scan_start


def needs_confirmation(names: list[str]) -> bool:
    """Whether a set of hypotheses is one answer beside `unlisted`."""
    return len(names) == 2 and UNLISTED in names


def confirmation_scan(
    whitened: WhitenedModel, names: list[str], limits: DriveLimits | None = None
) -> NextScan | None:
    """A sine inside what was recorded; `None` if the limits do not allow it.

    `names`: the set, see `needs_confirmation`. `limits`: as in `choose_next_scan`, and so are
    length and start.
    """
    recording = whitened.recording
    limits = Identified.of(recording).recorded_limits() if limits is None else limits
    samples, periods = scan_length(whitened)
    start = scan_start(recording)
    found = make_inner_sine(recording, limits, samples=samples, periods=periods, start_s=start)
    if found is None:
        return None
    (name,) = (n for n in names if n != UNLISTED)
    effects = describe_hypothesis(name, effect_labels(ALL, recording.response_unit))
    other = "an effect" if name == "none" else f"an effect other than {effects}"
    return NextScan(
        waveform=found.waveform,
        excitation_hz=found.excitation_hz,
        amplitude=found.amplitude,
        bias=found.bias,
        separates=[],
        power=0.0,
        left=None,
        pairs=[],
        candidates=[{**found.to_dict(), "power": 0.0, "checked": False, "left": None}],
        reason=(
            f"{found.describe(recording.drive_unit)}, inside the recorded range, where the "
            f"hysteresis is known: it shows whether {other} is missing."
        ),
        drive=found.drive,
    )
