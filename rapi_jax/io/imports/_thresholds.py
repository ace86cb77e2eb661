"""Numbers that decide how files become runs, with unit and origin."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class ImportThresholds:
    """Numbers that decide about clocks, cycles and runs of an import."""

    gap: float = threshold(
        1.5, unit="steps that are usual", origin="as in the check of the clock of a recording"
    )
    few_gaps: float = threshold(
        0.01, unit="of the steps", origin="convention; more are no gaps but uneven sampling"
    )
    hole: float = threshold(
        3.0,
        unit="steps of the even clock",
        origin="derivation: a straight line over so many is off a sine of 30 samples a period by "
        "5 % of its amplitude; readings are left out there",
    )
    backward_steps: float = threshold(
        0.01,
        unit="of the steps",
        origin="derivation: records below each other of 100 samples or more go back less often; a "
        "triangle or sine does half of the time",
    )
    uneven_step: float = threshold(
        0.01, unit="of a step", origin="rounding of printed times; less is made even"
    )
    off_clock: float = threshold(
        0.45,
        unit="of a step",
        origin="derivation: where a sample is missing, times are off an even clock by half a step",
    )
    rate_window: int = threshold(
        50, unit="samples", origin="set by trial; over so many, jitter is no sampling rate"
    )
    made_explained: float = threshold(
        0.5,
        unit="of the variance",
        origin="a response to another rate averages out over its periods",
    )
    flat_samples: int = threshold(
        5, unit="samples", origin="set by trial; shorter ones hide no part of a loop"
    )
    flat_ratio: float = threshold(
        6.0,
        unit="times the level beside",
        origin="derivation: the top of a digitised sine holds 2.4 times the samples of the next",
    )
    turn: float = threshold(
        0.05, unit="of the swing", origin="set by trial; a drive that turns by less is noisy there"
    )
    averaged_share: float = threshold(
        8.0,
        unit="widths of the average in a cycle",
        origin="derivation: it lowers a sine by 2.6 % and a triangle's turns by 6 % of the swing",
    )
    averaged_noise: float = threshold(
        1.4,
        unit="times the noise of neighbouring samples",
        origin="derivation: a tone of the noise's own size, removed with it, makes 1.41",
    )
    shape: float = threshold(
        0.03,
        unit="of the swing, rms",
        origin="as the period check has it; a drive that is nearer has that waveform",
    )
    commanded_ratio: float = threshold(
        3.0,
        unit="times nearer to a triangle or a sine",
        origin="as `commanded_ratio` of the data checks; 1.5: chance tells two measured columns "
        "apart, 6: columns with noise of 0.7 % of the span are not told",
    )
    commanded: float = threshold(
        0.01,
        unit="of the span, rms",
        origin="a response of the paper's device departs by 4 %, a triangle read by eight bits by "
        "0.25 %; 0.005: noise of 0.5 % hides a swap, 0.02: nearly straight devices are told",
    )
    few_periods: int = threshold(
        3,
        unit="whole periods",
        origin="over the one whole period of 2.4 harmonics of 0.2 % look like another rate, by "
        "5e-3 to 8e-3 in four drives, over all samples by less than 1e-3; neither half nor double "
        "was tried",
    )
    round_rate: float = threshold(
        5e-4, unit="relative", origin="a setting of three digits; beside `rate_slip`"
    )
    late_cycle: float = threshold(
        0.03,
        unit="of a period",
        origin="set by trial; a cycle that is off by more is of another rate",
    )
    rate_slip: float = threshold(
        0.02, unit="periods over a run", origin="phases stay as good as they are known"
    )
    same_rate: float = threshold(
        0.1, unit="relative", origin="set by trial; noise displaces a turn by so much of a period"
    )
    same_level: float = threshold(
        0.03, unit="of the swing", origin="set by trial; above the noise of a reading of eight bits"
    )
    stated_rate: float = threshold(
        0.02, unit="relative", origin="convention; a rate that was said may be off by so much"
    )
    early_start: float = threshold(
        0.004,
        unit="of a period",
        origin="below `period_edge`: the first period still begins there, and the last is whole",
    )
    shared_samples: float = threshold(
        0.02, unit="of a period", origin="set by trial; what noise displaces a turn by"
    )
    repeats: float = threshold(
        0.03,
        unit="of the swing",
        origin="as `same_level`; a broken end that differs by less is of the run",
    )
    repeats_again: float = threshold(
        1.5,
        unit="times the largest change from period to period within a run",
        origin="derivation: noise rarely exceeds the largest of as many other samples by half",
    )
    equal: float = threshold(
        1e-9, unit="of the range", origin="rounding of numbers; a drive so near repeats exactly"
    )
    period_samples: int = threshold(
        500, unit="samples a period", origin="as a fit thins; it loses nothing of the shape"
    )
    fringe_samples: float = threshold(
        4.0, unit="samples a fringe", origin="twice the least by Nyquist; fewer are reported"
    )
    fringe_noise: float = threshold(
        0.4,
        unit="of the fringes' amplitude",
        origin="white noise alone leaves 2, fringes of half the sampling rate 0.5, noise of a "
        "third of the fringes 0.3; set by trial",
    )
    waveform_samples: int = threshold(
        50_000,
        unit="samples",
        origin="time; halved: phase and levels 1.4 times less certain, doubled: a second more",
    )
    waveform_sigmas: float = threshold(
        4.0,
        unit="standard errors",
        origin="convention; 2: noise makes one drive in 20 asymmetric by chance, 8: a rate or a "
        "rise that is off by less than 8 errors is not followed",
    )
    waveform_miss: float = threshold(
        4e-3,
        unit="of the swing",
        origin="twice half a step of eight bits, the usual nonlinearity of a scope's converter; "
        "2e-3: true triangles read by eight bits are refused, 8e-3: turns that an amplifier of 40 "
        "times the scan rate rounds (by 1 / (40 pi)) are taken for sharp ones",
    )
    harmonic_price: float = threshold(
        9.0,
        unit="times the noise power of a harmonic",
        origin="derivation: of exponentially distributed powers one in 8000 is as large; 4: a few "
        "harmonics of noise are kept, 18: some of 3 to 4 standard errors are lost",
    )
    converter_levels: float = threshold(
        0.7,
        unit="of the samples",
        origin="as `distinct_values` of the data checks; 0.35: 12 bits of few samples are not seen "
        "as steps, 1.4: any record is",
    )
    quiet_samples: int = threshold(
        2000, unit="samples a period", origin="of a mean period in which a drive's turns are sought"
    )


THRESHOLDS = ImportThresholds()
