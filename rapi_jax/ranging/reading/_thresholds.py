"""Numbers that decide how scans are read."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class ReadingThresholds:
    """Numbers that decide how scans are read."""

    samples_per_fringe: tuple[float, float] = threshold(
        (6.0, 10.0),
        unit="samples",
        origin="kept in the fastest fringe of interferometer and measurement arm, whose "
        "samples are interpolated; means over a group then lose 4.5 % and 1.6 % of the visibility",
    )
    scans_together: int = threshold(
        8,
        unit="scans",
        origin="in one transform: what a processor's cache holds; changes no result",
    )
    block_periods: int = threshold(
        32, unit="periods", origin="read at once: what stays in memory; changes no result"
    )
    turn_bins: int = threshold(
        1000, unit="bins a period", origin="of folded time; a turn is found to about half of one"
    )
    turn_periods: int = threshold(
        8, unit="periods", origin="folded together; a clock wrong by 1e-4 then blurs by 0.8 bin"
    )
    turn_contrast: float = threshold(
        8.0,
        unit="standard deviations",
        origin="irregularity of the fringe rate at a turn over its scatter elsewhere; of 1000 bins "
        "none reaches it by chance",
    )
    irregular: float = threshold(
        0.5,
        unit="of half a fringe",
        origin="by which the phase jumps at a turn (evenly 0 to 1, by where in a fringe it turns); "
        "or three times what 98 % of the fringes have",
    )
    turn_place: float = threshold(
        0.02, unit="periods", origin="how far off a turn may be: `near_turn`, of two branches"
    )
    at_start: float = threshold(
        0.003,
        unit="periods",
        origin="a turn so near a record's first sample is its start: how well a turn is found",
    )
    rate_off: float = threshold(
        0.015,
        unit="periods",
        origin="over a record, by which its scan rate must be off to be said: four times the error "
        "with which a turn is found; 1 in 60 of short records said so at a third of it",
    )
    near_turn: float = threshold(
        0.04, unit="branches", origin="left out next to a turn, where the fringe rate changes"
    )
    band: tuple[float, float] = threshold(
        (0.2, 5.0),
        unit="times the usual fringe rate",
        origin="passed of the interferometer: RA-PI's branches are within 0.5 and 2",
    )
    low_light: float = threshold(
        0.3, unit="of the usual visibility", origin="below it fringes count as lost; trial"
    )
    stretches: int = threshold(
        64, unit="stretches of a scan", origin="in which light is looked at: 0.6 ms at 10 Hz"
    )
    nyquist: float = threshold(
        0.4, unit="of the sampling rate", origin="fringes faster than this may be aliased"
    )
    peak_level: float = threshold(
        0.5, unit="of the height", origin="a cavity's peak is what rises above it"
    )
    join_peaks: float = threshold(
        0.3, unit="orders", origin="stretches of light nearer than this are one peak"
    )
    fewest_samples: int = threshold(
        4, unit="samples", origin="in a cavity's peak: a parabola has three parameters"
    )
    fewest_steps: int = threshold(
        8, unit="orders", origin="from peak to peak; their median is then good to a few per mille"
    )
    fewest_slopes: int = threshold(
        6, unit="scans", origin="whose slopes' scatter is then known to 30 %; fewer say little"
    )
    path_near: float = threshold(
        0.002,
        unit="relative",
        origin="by which a path may be off: over 40 orders within `off_comb`",
    )
    path_far: float = threshold(
        0.2, unit="relative", origin="no fibre is known so badly; a missing order is a factor of 2"
    )
    off_comb: float = threshold(
        0.1, unit="orders", origin="a peak farther from its order is none of the comb; trial"
    )


THRESHOLDS = ReadingThresholds()
