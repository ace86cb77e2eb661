"""Numbers that decide how noise is described and estimated."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class NoiseThresholds:
    """Corners of relaxations, bins of Fourier lines, and the choice of processes."""

    slowest_corner: float = threshold(
        0.1,
        unit="of the longest run's reciprocal",
        origin="half and twice as slow change the coverage of seven noises by 0.6 % at most",
    )
    fastest_corner: float = threshold(
        0.1,
        unit="of the fastest sampling rate",
        origin="faster ones are near white; half and twice as fast: 1/f noise covered in 92.0 "
        "instead of 94.2 % (40 replicates), others by 1.5 % at most",
    )
    corner_ratio: float = threshold(
        2.0,
        unit="ratio of neighbouring corners",
        origin="squared it covers 1/f noise in 91.2 instead of 94.2 % and AR(1) noise too often; "
        "its root changes 2 % at most",
    )
    flicker_exponents: tuple[float, ...] = threshold(
        (0.75, 1.0, 1.25, 1.5), unit="1", origin="convention; a single relaxation falls with 2"
    )
    single_lines: int = threshold(
        4, unit="lines", origin="set by trial; that many of the slowest are bins of their own"
    )
    bin_ratio: float = threshold(1.25, unit="ratio of frequencies", origin="set by trial")
    least_group_lines: int = threshold(
        6, unit="lines", origin="set by trial; of so few a tone does not move the median"
    )
    corner_below: float = threshold(
        4.0,
        unit="slowest frequency seen",
        origin="set by trial; how far below it the slowest corner may lie",
    )
    median_passes: int = threshold(
        3, unit="passes", origin="set by trial; the first expects the same of all lines"
    )
    least_freedom: float = threshold(
        0.1, unit="degrees of freedom", origin="set by trial; bins with fewer left say nothing"
    )
    first_harmonics: float = threshold(
        33.0, unit="scan rate", origin="set by trial; what models miss lies below"
    )
    most_processes: int = threshold(4, unit="processes", origin="set by trial")
    chance_gain: float = threshold(
        3.0,
        unit="log-likelihood",
        origin="1 in 20 by chance for two numbers; half of it changes coverage by 0.5 % at most, "
        "twice covers 1/f noise in 90.2 instead of 94.2 %",
    )
    own_passes: int = threshold(
        2, unit="passes", origin="set by trial; where runs differ, the noise of one shows in others"
    )
    new_share: float = threshold(0.1, unit="of the variance", origin="set by trial")
    least_log_variance: float = threshold(40.0, unit="1", origin="set by trial")
    steps: int = threshold(15, unit="steps", origin="set by trial")
    settled: float = threshold(
        1e-10, unit="of the logarithm of a variance", origin="rounding; a further step changes it"
    )
    damping: float = threshold(1e-6, unit="of the largest information", origin="set by trial")


THRESHOLDS = NoiseThresholds()
