"""Numbers that decide how periods are cut and noise is measured."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class NoiseThresholds:
    """Sampling of periods, lines that show noise, slow changes of a session."""

    most_samples: int = threshold(
        1024, unit="samples a period", origin="set by trial; runs sampled finer are decimated"
    )
    least_samples: int = threshold(
        512, unit="samples a period", origin="set by trial; decimation leaves at least as many"
    )
    slowest_line: int = threshold(
        6,
        unit="lines of a run",
        origin="set by trial; below, slow effects and not noise dominate",
    )
    least_lines: int = threshold(8, unit="lines", origin="set by trial; with fewer, their mean")
    fastest_fraction: float = threshold(
        0.6,
        unit="lines of a run",
        origin="set by trial; noise is read off the lines above where nothing repeats, or only "
        "what is sampled more slowly; no other was tried",
    )
    resolution: float = threshold(
        1e-6, unit="span of the readings", origin="set by trial; no reading is better than this"
    )
    trend_powers: int = threshold(3, unit="powers of session time", origin="set by trial")
    settling_lags: int = threshold(
        3,
        unit="exponentials",
        origin="set by trial; lags between a period and a run, for what settles after a start",
    )
    trend_gain: float = threshold(
        30.0,
        unit="chi-square",
        origin="beyond the 0.1 % point for six columns (22.5); smaller trends are left in",
    )
    noise_signal: float = threshold(
        0.5,
        unit="of the readings' variance",
        origin="convention; of so much the model says nothing",
    )
    noise_slow: float = threshold(
        0.5,
        unit="of the mean square",
        origin="convention; where nothing repeats, what is mostly slow is not called noise",
    )
    noise_sigmas: float = threshold(
        3.0,
        unit="standard errors",
        origin="1000 draws of 40 to 4000 white samples: less than 0.1 %",
    )
    white_error: float = threshold(
        2.9,
        unit="over the root of the samples",
        origin="1000 draws each of 40 to 4000 white samples: standard deviation 2.5 to 3.0",
    )
    noise_drive: float = threshold(
        0.3, unit="of the mean square", origin="convention; beyond chance, noise follows no drive"
    )
    drive_bins: int = threshold(12, unit="bins a direction", origin="convention")
    drive_passes: float = threshold(
        3.0,
        unit="passes of a bin",
        origin="convention; with fewer a slow residual follows any drive",
    )
    level_samples: int = threshold(
        5, unit="samples", origin="the shortest level; two wrong readings move no median of five"
    )
    level_lengths: int = threshold(
        4, unit="lengths", origin="a factor of two apart: the longest is a tenth of a period"
    )
    outlier_sigmas: float = threshold(
        4.0,
        unit="standard deviations",
        origin="one normal reading in 16 000 lies farther from its neighbours, or a step from 0",
    )
    own_step: float = threshold(
        0.6,
        unit="largest steps",
        origin="derivation: of three periods or more, what a step leaves in the others is at most "
        "half of it",
    )
    least_steps: int = threshold(10, unit="levels of a run", origin="with fewer no tail is seen")
    steep_slope: float = threshold(
        2.0,
        unit="median slopes",
        origin="derivation: of a sine the steepest is 1.4. Periods of a magnetic core differ by "
        "its slope's jitter: p is 2e-6 with all samples, and above 0.05 from 1.2 to 4 here",
    )
    jump_p_value: float = threshold(
        1e-3,
        unit="probability",
        origin="one recording without jumps in 1000. Of readings less what repeats: 163 simulated "
        "nulls have 0.03 at least; of 13 devices with jumps of 4 to 18 times the noise 9 are below "
        "it, 8 at half and 9 at double",
    )


THRESHOLDS = NoiseThresholds()
