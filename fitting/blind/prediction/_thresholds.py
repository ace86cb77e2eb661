"""Numbers that decide how the baselines and the second measurements work."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class PredictionThresholds:
    """Baseline verdicts, and second measurements of devices with several causes."""

    baseline_level: float = threshold(
        0.01, unit="probability", origin="nominal level of one test; the baselines are not tuned"
    )
    selected_effects: int = threshold(
        3, unit="effects", origin="set by trial; the most that forward selection adds"
    )
    short_refits: int = threshold(5, unit="effects a round", origin="set by trial; costs time")
    full_refits: int = threshold(2, unit="effects a round", origin="set by trial; costs time")
    follow_ups: int = threshold(40, unit="devices", origin="set by trial; two diagnoses each")
    scan_draws: int = threshold(
        1000, unit="draws", origin="set by trial; then the advised scan is repeated"
    )
    default_workers: int = threshold(
        2, unit="processes", origin="set by trial; memory of a diagnosis limits it"
    )


THRESHOLDS = PredictionThresholds()
