"""Response of a model to a session of scans, on the session's clock."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fitting.blind.simulator._scan import Scan
from rapi_jax import ECDL, Drive, Recording
from rapi_jax.internal import float64, known_response, to_batch

Array = npt.NDArray[np.float64]


def to_drive(scan: Scan) -> Drive:
    """The drive that a recording of `scan` holds; one with a table repeats as well."""
    known = ("triangle", "sine")
    waveform = scan.waveform if scan.waveform in known else "multisine"
    return Drive(scan.time_s, scan.drive, scan.rate_hz, waveform, scan.start_s)  # pyright: ignore


@float64
def model_response(ecdl: ECDL, scans: Sequence[Scan]) -> list[Array]:
    """The model's noise-free response to each of `scans`, in its own unit: one session.

    Effects see the session's time, and what has a memory of earlier runs keeps it.
    """
    drives = [to_drive(scan) for scan in scans]
    data = to_batch(Recording.of(drives, [drive.value for drive in drives]), lead=True)
    rows = known_response(ecdl, data.device())
    out = []
    for k, drive in enumerate(drives):
        answer = np.full(drive.size, np.nan)
        inside = data.sample[k] >= 0
        answer[data.sample[k][inside]] = rows[k][inside]
        out.append(answer)
    return out
