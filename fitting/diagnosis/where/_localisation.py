"""Where the gap lies: by run, by direction of the drive, at turning points or between them."""

from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from rapi_jax import Recording

from ._cells import cells
from ._gap import Gap, measure_gap


def localise(
    errors: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    spectrum: Spectrum,
    recording: Recording,
    *,
    own_origin: bool = False,
) -> list[dict[str, Any]]:
    """The list `where` of a diagnosis, largest share first.

    `rms`: of what repeats with the scan, above noise, in that part of the run; `rms_not_locked`: of
    what does not; 0 where noise explains it. `share` of the recording's gap, both kinds: parts that
    noise explains have none, the others sum to 1; all are 0 where there is no gap. `of_readings`:
    the part's share of the data.
    """
    found = cells(errors, blocks, spectrum, recording, own_origin=own_origin)
    whole = measure_gap(errors, blocks, spectrum, own_origin=own_origin)
    positive = sum(max(c.structural, 0.0) for c in found)
    scale = 1.0 / positive if _any_gap(whole) and positive > 0 else 0.0
    readings = sum(c.readings for c in found)
    entries = []
    for c in found:
        run = recording.runs[c.run]
        entries.append(
            {
                "run": c.run,
                "name": run.name,
                "excitation_hz": run.drive.excitation_hz,
                "amplitude": run.drive.u_pp,
                "direction": "up" if c.up else "down",
                "region": "edge" if c.edge else "middle",
                "rms": float(np.sqrt(max(c.synchronous2, 0.0))),
                "rms_not_locked": float(np.sqrt(max(c.nonsynchronous2, 0.0))),
                "share": max(c.structural, 0.0) * scale,
                "of_readings": c.readings / readings,
            }
        )
    entries.sort(key=lambda entry: -entry["share"])
    return entries


def _any_gap(whole: Gap) -> bool:
    return whole.significant and max(whole.synchronous, whole.structural2) > 0
