"""A drive that was sent and not recorded, from its amplitude, offset and rate."""

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError

from ._options import MadeDrive
from ._thresholds import THRESHOLDS


def make_drive(made: MadeDrive, time: Float[np.ndarray, " samples"]) -> np.ndarray:
    """Its values at `time` (s from the first sample), in its own unit."""
    cycles = made.rate * time + made.phase
    shape = (
        -np.cos(2.0 * np.pi * cycles)
        if made.waveform == "sine"
        else 1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles, 1.0))
    )
    return made.offset + made.amplitude / 2.0 * shape


def check_made(
    made: MadeDrive, time: Float[np.ndarray, " samples"], response: Float[np.ndarray, " samples"]
) -> str:
    """What the response says of a drive that was made: how far its turns are from the drive's.

    Raises `DataError` where the response does not repeat at the drive's rate.
    """
    good = np.isfinite(response)
    cycles, y = (made.rate * time + made.phase)[good], response[good]
    bins = int(np.clip(good.sum() / max(float(np.ptp(cycles)), 1.0), 8, 64))
    place = np.minimum((np.mod(cycles, 1.0) * bins).astype(int), bins - 1)
    count = np.maximum(np.bincount(place, minlength=bins), 1)
    mean = np.bincount(place, y, minlength=bins) / count
    explained = float(np.var(mean[place])) / max(float(np.var(y)), 1e-300)
    if float(np.ptp(cycles)) > 1.5 and explained < THRESHOLDS.made_explained:
        raise DataError(
            f"the response does not repeat at {made.rate:g} Hz (its mean period explains "
            f"{100 * explained:.0f} % of it): the rate of the drive is another one. Correct "
            "--drive-rate (in Hz), or the time's unit."
        )
    low = (int(np.argmin(mean)) + 0.5) / bins
    late = (low + 0.5) % 1.0 - 0.5
    return f"the response has its minimum {late:+.2f} of a period after the drive's"
