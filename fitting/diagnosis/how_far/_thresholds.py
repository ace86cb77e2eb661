"""Numbers that decide how held-out data are split, and how wide intervals are."""

import dataclasses

from rapi_jax.internal import threshold

_TRIAL = "set by trial"


@dataclasses.dataclass(frozen=True)
class HowFarThresholds:
    """Numbers of cross-validation, bootstrap and predicted gain."""

    # Cross-validation.
    refit_steps: int = threshold(
        6,
        unit="steps from one Jacobian",
        origin="2 simulated devices: 40 instead take 1.1 and 3.3 times as long and move closed "
        "fractions of determined parts by up to 0.12",
    )
    refit_jacobians: int = threshold(
        4,
        unit="Jacobians",
        origin="as above: closed fractions then are those of 40 steps, each with a Jacobian of its "
        "own, to 0.01 where they are 0.97 or more, else to 0.07",
    )
    refit_tolerance: float = threshold(
        1e-2,
        unit="of the excess",
        origin="a smaller fall ends a refit: so much of what the gap leaves on data held out. Of "
        "three simulated devices 1.0001, 0.9992 and 0.9776 are closed; with 1e-4, and no "
        "`refit_least_gain`, in 2 to 3 times the time, 1.0000, 1.0024 and 0.9751",
    )
    refit_least_gain: float = threshold(
        1e-3, unit="of the lines' number", origin="as above, of the noise that is there anyway"
    )
    training_share: float = threshold(
        2.0 / 3.0, unit="of the periods", origin="the files' contract: the last third is held out"
    )
    least_periods: int = threshold(
        3, unit="periods", origin="fewer leave no third of whole periods to hold out"
    )
    least_samples: int = threshold(
        60, unit="samples", origin=f"{_TRIAL}; of a run without periods that is cut in time"
    )
    samples_per_value: float = threshold(
        2.0, unit="samples a parameter", origin=f"{_TRIAL}; fewer training samples skip a part"
    )
    as_good_chance: float = threshold(
        1e-3,
        unit="probability",
        origin="of a fall in chi-square that large among models as good; a half, double or tenth "
        "of it moves the limit by under 18 %",
    )
    segments: int = threshold(
        10, unit="segments of a run", origin=f"{_TRIAL}; resampled where nothing repeats"
    )
    segment_draws: int = threshold(1000, unit="draws", origin=f"{_TRIAL}; of segments")
    unknown_noise_widening: float = threshold(
        2.0, unit="of the interval", origin=f"{_TRIAL}; where noise is unknown"
    )

    # Bootstrap.
    level: float = threshold(0.95, unit="probability", origin="the files' contract")
    single_run_widening: float = threshold(
        2.0, unit="of the interval", origin="one run stands for all, and another may differ"
    )
    least_gap: float = threshold(
        0.25, unit="of the gap before", origin=f"{_TRIAL}; a draw with less counts as this much"
    )
    least_pairs: int = threshold(
        4, unit="neighbouring periods", origin=f"{_TRIAL}; fewer show no correlation"
    )
    correlation_sigmas: float = threshold(
        2.0, unit="standard errors", origin="about 95 %: less correlation is chance"
    )
    largest_correlation: float = threshold(
        0.9, unit="1", origin=f"{_TRIAL}; keeps the block length finite"
    )

    # Predicted gain.
    ramp_start: float = threshold(0.1, unit="of a ramp's time", origin=f"{_TRIAL}; before: turning")
    ramp_end: float = threshold(0.9, unit="of a ramp's time", origin=f"{_TRIAL}; after: turning")
    structure_sigmas: float = threshold(
        2.0, unit="standard errors", origin=f"{_TRIAL}; by which more structure may be left"
    )
    other_scan_factor: float = threshold(
        1.3, unit="rms", origin=f"{_TRIAL}; either way: the scan is not one of those recorded"
    )
    least_error: float = threshold(
        1e-12, unit="of the gap's square", origin="rounding: nothing closes a gap farther"
    )
    full_swing: float = threshold(
        0.98, unit="of the widest swing", origin=f"{_TRIAL}; from it a run has the full swing"
    )


THRESHOLDS = HowFarThresholds()
