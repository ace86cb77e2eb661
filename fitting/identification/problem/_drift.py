"""Session time as a drift of the origin goes with it."""

import numpy as np

from rapi_jax import Recording
from rapi_jax.internal import Batch


def session_decades(recording: Recording, data: Batch) -> np.ndarray:
    """Decades of session time since the start, one period being the first unit: as creep goes.

    Where no run has a rate, the longest run is that unit.
    """
    first = min(drive.start_s for drive in recording.drives)
    periods = [1.0 / drive.rate for drive in recording.drives if drive.rate > 0]
    unit = max(periods or [float(drive.time[-1]) for drive in recording.drives])
    return np.log10(1.0 + np.maximum(data.time - first, 0.0) / unit)
