"""Numbers that decide what a diagnosis warns about."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class DiagnosisThresholds:
    """Limits of the data checks."""

    consistency_steps: int = threshold(
        60,
        unit="steps",
        origin="measured on 7 faults of runs and 4 effects: of 195 refits half take 4 steps, one "
        "in ten 34 or more; half and double find the same faults",
    )
    least_explained: float = threshold(
        0.5,
        unit="variance of the readings",
        origin="set by trial; a model that explains less is named as a fault of the data",
    )
    repeats: float = threshold(
        1e-3,
        unit="of the drive's range",
        origin="derivation: a commanded drive repeats to rounding, 2.4e-4 for 12 bits; a noisy one "
        "of 8 bits does not, and stays as it was said to be",
    )
    probable: float = threshold(
        0.5,
        unit="probability",
        origin="derivation: more probable than all other answers together; below, it may be",
    )
    still_open: float = threshold(
        0.5,
        unit="of the mean square above the noise",
        origin="convention; of six plays fixed in volts 24 on a grid leave 0.86 of it. Decides "
        "which model is advised, where both their residuals are stated",
    )
    larger_gap: float = threshold(
        3.0,
        unit="size of the jumps",
        origin="convention; jumps make at most half their size rms, so a sixth of such a gap, and "
        "the gap comes first; of a simulated laser with jumps alone it is 0",
    )


THRESHOLDS = DiagnosisThresholds()
