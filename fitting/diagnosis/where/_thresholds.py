"""Numbers that decide where the gap lies and whether there is one."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class WhereThresholds:
    """Levels of tests, the search for tones, and what a description names."""

    false_alarm_level: float = threshold(
        0.01, unit="probability", origin="convention; of a gap, a tone, and false ones of harmonics"
    )
    unrepeated_variance_ratio: float = threshold(
        4.0,
        unit="white noise",
        origin="set by trial; where nothing repeats, a mean square above it is a gap",
    )
    unrepeated_level: float = threshold(
        1e-6, unit="probability", origin="set by trial; the same, of noise alone"
    )
    first_harmonics: int = threshold(
        4, unit="harmonics", origin="set by trial; most model error is slow and tested by itself"
    )
    more_harmonics: int = threshold(16, unit="harmonics", origin="set by trial; a second such band")
    least_variance_share: float = threshold(
        0.02, unit="variance before", origin="set by trial; left where a shared part drops out"
    )
    process_information: float = threshold(
        0.1, unit="1", origin="set by trial; wide prior on the logarithm of a process's variance"
    )
    neighbouring_harmonics: int = threshold(
        3, unit="harmonics", origin="set by trial; lines within, on both sides, give the noise"
    )
    tone_exclusion: float = threshold(
        1.5, unit="lines of a run", origin="width of a line; nearer to a tone no noise is read"
    )
    single_period_ratio: float = threshold(
        16.0,
        unit="white noise",
        origin="set by trial; power of a harmonic that is named where no period repeats",
    )
    single_period_lines: float = threshold(
        0.4, unit="samples", origin="the fastest 40 % of the lines, from which noise was read"
    )
    tone_grid_density: int = threshold(
        6, unit="points a line of the longest run", origin="set by trial; grid of the tone search"
    )
    most_tones: int = threshold(8, unit="tones", origin="set by trial")
    most_listed_harmonics: int = threshold(20, unit="harmonics", origin="length of a list")
    least_tone_share: float = threshold(
        0.3,
        unit="power of a tone",
        origin="set by trial; what must be left of it when the mean period is subtracted",
    )
    level_lines: int = threshold(
        25, unit="lines to either side", origin="set by trial; for the local level of the noise"
    )
    edge_fraction: float = threshold(
        0.1, unit="length of a branch", origin="convention; what counts as near a turning point"
    )
    least_excess_share: float = threshold(
        0.15,
        unit="gap less readings",
        origin="set by trial; by which a part's share of the gap must exceed its share of the data",
    )
    least_named_share: float = threshold(
        0.4, unit="gap", origin="set by trial; what a part must hold to be named"
    )
    word_information: float = threshold(
        0.05, unit="nat", origin="set by trial; what a further word must add"
    )
    same_amplitude: float = threshold(
        0.02, unit="amplitude", origin="set by trial; amplitudes that near count as one"
    )
    dominance: float = threshold(
        2.0, unit="1", origin="set by trial; ratio from which one kind of error is called most"
    )
    pooled_freedom: float = threshold(
        4.0,
        unit="degrees of freedom",
        origin="set by trial; what the scatter of a run's other bins counts in one bin's",
    )


THRESHOLDS = WhereThresholds()
