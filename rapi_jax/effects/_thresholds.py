"""Numbers that decide where a fit of an effect starts, and where an effect has no inverse."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class EffectThresholds:
    """Numbers that decide first guesses, inverses and numerical limits of the effects.

    None of them changes what an effect computes at given parameters, but for the limits of lags
    and slopes, which stand for zero and infinity.
    """

    # Amplitudes
    least_amplitude_of_span: float = threshold(
        1e-4, unit="of the span", origin="detectable where the noise is not known; set by trial"
    )
    least_amplitude: float = threshold(
        1e-4, unit="response unit", origin="where neither noise nor span is known; set by trial"
    )

    # First-order lags
    least_gain: float = threshold(
        1e-9, unit="1", origin="a frequency that passes with less is lost to rounding"
    )
    least_time_constant: float = threshold(
        1e-15, unit="s", origin="a lag as short as this counts as none"
    )

    # Amplitude law
    pivot_reach: float = threshold(
        2.0,
        unit="of the response from zero drive",
        origin="keeps any pivot that the response crosses; with 1, 4 and 8 a device whose pivot "
        "went to -24 570 GHz without it has the same name, at over 0.999, and closes the same",
    )
    same_amplitude: float = threshold(
        0.02, unit="of the amplitude", origin="amplitudes and biases that differ less count as one"
    )

    # Current coupling
    coupling_least_lag: float = threshold(
        1e-7, unit="s", origin="keeps the quotient by the lag finite; set by trial"
    )
    coupling_sudden_lag: float = threshold(
        1e-5, unit="s", origin="scale below which a corner is seen from both sides; set by trial"
    )
    slopes_bucket: int = threshold(
        4096, unit="samples", origin="runs padded to a multiple share compiled code"
    )

    # Etalon
    etalon_cycles: int = threshold(
        120, unit="cycles in the span", origin="finest spacing tried; larger costs time"
    )
    etalon_fast_cycles: float = threshold(
        5.0, unit="cycles in the span", origin="fewer count as a slow ripple; set by trial"
    )
    etalon_spacings: int = threshold(
        2, unit="candidates", origin="of slow and of fast ripples each; set by trial"
    )
    etalon_slope_samples: int = threshold(
        4001, unit="samples in a fringe", origin="at which the slope is checked before inversion"
    )
    etalon_iterations: int = threshold(
        60, unit="steps", origin="of bracketed Newton: bisection alone then reaches rounding"
    )

    # Mode hop
    hop_bins: int = threshold(300, unit="bins", origin="over the response; set by trial")
    hop_line_bins: int = threshold(
        8, unit="bins", origin="on either side of a step, for a straight line; set by trial"
    )
    hop_steps: int = threshold(3, unit="steps", origin="in each direction; set by trial")
    hop_apart: float = threshold(
        0.03, unit="of the span", origin="least distance of two steps; set by trial"
    )
    creep_lead_s: tuple[float, float] = threshold(
        (0.1, 0.01), unit="s", origin="convention: a drive is on first for a tenth of a second, or"
    )
    creep_lead_periods: tuple[float, float] = threshold(
        (0.1, 2.0), unit="periods", origin="convention: for two periods"
    )
    hop_settled: float = threshold(1e-9, unit="s", origin="a shorter settling time counts as none")
    hop_sudden: float = threshold(
        1e-8, unit="s", origin="settling time to start from for a sudden hop, just above none"
    )
    hop_wide: float = threshold(
        0.02, unit="of the span", origin="hysteresis tried beside the one that shows; set by trial"
    )
    hop_slow: float = threshold(
        3.0, unit="samples", origin="settling time tried beside none; set by trial"
    )
    hop_outlier: float = threshold(
        8.0,
        unit="robust standard deviations",
        origin="of the change from one sample to the next that counts as a jump; set by trial",
    )
    hop_alike: float = threshold(
        0.5,
        unit="of the largest jump",
        origin="hops are of one size; a third where noise is as large as a hop, which is none",
    )
    hop_narrow: float = threshold(
        1e-3, unit="of the span", origin="least hysteresis to start from; set by trial"
    )

    # Pickup
    pickup_cells: int = threshold(
        2**21, unit="cells", origin="of the session's clock at most; larger costs memory and time"
    )
    pickup_slip: float = threshold(
        0.1, unit="cycles a session", origin="a tone that slips by less repeats with every scan"
    )
    pickup_least_cycles: float = threshold(
        1.0,
        unit="cycles in all runs",
        origin="derivation: less of a sine is a bend, as of drift. Of 5000 simulated sessions of "
        "any design with a tone of 30 to 900 Hz none holds less",
    )
    pickup_lines: int = threshold(
        2, unit="lines", origin="from each spectrum and from the mains' harmonics; set by trial"
    )
    pickup_apart: int = threshold(
        8, unit="frequency steps", origin="least distance of two lines; set by trial"
    )
    pickup_high: float = threshold(
        0.25,
        unit="of the clock's rate",
        origin="of a cell; beyond, samples share a cell in another phase",
    )
    pickup_highest: float = threshold(
        1000.0,
        unit="Hz",
        origin="of tones that are looked for although each run reads more slowly: sound and "
        "harmonics of the mains that a mount passes on",
    )
    pickup_alias: float = threshold(
        1.5,
        unit="of the power of the strongest tone below",
        origin="at which a tone beyond each run's Nyquist frequency is tried. By arithmetic: of "
        "two runs as long that begin at chance a false one keeps half of the power on average; at "
        "1 chance decides between them, at 3 two such runs hide it",
    )
    pickup_periods: float = threshold(
        1.98, unit="periods", origin="a run of fewer has no mean period; two less rounding"
    )

    pickup_lowest_line: float = threshold(
        20.0,
        unit="Hz",
        origin="of what has harmonics: mains, fans, sound; thirty harmonics of a tone as long as a "
        "session are any function of time, and a drift would be called pickup",
    )
    slow_pickup_odds: float = threshold(
        20.0,
        unit="to one",
        origin="against a tone below `pickup_lowest_line`: mains, fans, pumps and sound are faster "
        "than what regulation and drift do. From the evidence of 246 simulated lasers, 11 with "
        "pickup, 3 more are then right first and of 10 surely wrong answers 3 are left in doubt; "
        "half: 4 and 3, double: 3 and 3",
    )
    pickup_harmonics: int = threshold(
        30,
        unit="harmonics",
        origin="pulses of 0.4 ms twice a cycle of the mains need those to 1 kHz, 16 and more",
    )

    # Other forms of a mechanism
    slow_functions: int = threshold(
        2,
        unit="functions a run",
        origin="of a gain: the fastest takes a run for its cycle, and there are as many as of "
        "levels and slopes that begin anew with each run, its rivals",
    )
    walk_functions: int = threshold(
        80,
        unit="functions a run",
        origin="those within a run count: of 4 simulated random walks and a diffusion of heat all "
        "are named drift, with half 4, with a quarter 2; double, on one of them: the same",
    )
    most_walk_functions: int = threshold(
        640, unit="functions", origin="more cost time and memory; those of eight runs"
    )
    hunting_cycles: float = threshold(
        4.0,
        unit="cycles in the session",
        origin="fewer are a bend, as of drift; from there by octaves",
    )
    etalon_beat_steps: float = threshold(
        6.0,
        unit="spacings tried a cycle in the span",
        origin="set by trial: two simulated pairs of cavities are explained; fewer cost less time",
    )
    etalon_beat_apart: float = threshold(
        0.3,
        unit="cycles in the span",
        origin="nearer ones are the cavity's own fringes, a little off",
    )
    uneven_levels: int = threshold(
        256, unit="levels", origin="8 bits of the swing; more cost time, and each is hardly seen"
    )

    # Quantisation
    coarsest_bits: int = threshold(
        6, unit="bits of the drive's range", origin="coarsest converter tried"
    )
    finest_bits: int = threshold(
        14, unit="bits of the drive's range", origin="finest converter tried, in steps of two"
    )
    finest_step: float = threshold(
        2.0**-14,
        unit="of the drive's range",
        origin="finest sawtooth looked for: converters are seldom used to their ends",
    )
    fewest_steps: float = threshold(
        4.0, unit="steps in the drive's range", origin="coarsest sawtooth looked for; set by trial"
    )
    quantisation_cells: int = threshold(
        2**19, unit="cells", origin="of the drive's range at most; larger costs memory and time"
    )
    quantisation_lines: int = threshold(4, unit="lines", origin="of the spectrum; set by trial")
    quantisation_apart: int = threshold(
        6, unit="frequency steps", origin="least distance of two lines; set by trial"
    )

    # Resonance
    ringing_runs: int = threshold(
        2, unit="runs", origin="the fastest, in which ringing is looked for; set by trial"
    )
    ringing_fastest: float = threshold(
        2.0, unit="sampling rates", origin="a ringing too fast to be sampled still delays"
    )
    ringing_places: float = threshold(
        4.0,
        unit="places a period",
        origin="of the fastest ringing that is looked for; twice what sampling needs",
    )
    ringing_candidates: int = threshold(
        4, unit="frequencies", origin="of the fine grid that are tried; set by trial"
    )
    ringing_peaks: int = threshold(
        3, unit="frequencies", origin="of the fine grid for each damping; set by trial"
    )
    ringing_samples: int = threshold(
        16, unit="samples", origin="a run of fewer is passed over; set by trial"
    )

    # Saturation
    start_knee: float = threshold(
        1e-2,
        unit="of the drive's range",
        origin="knee to start from: from a sharp one, Gauss-Newton steps stall at single samples",
    )
    least_room: float = threshold(
        1e-6, unit="knees", origin="nearer to the end the inverse grows without bound"
    )
    knee_reach: float = threshold(
        40.0, unit="knees", origin="farther from the end exp(-40) is below rounding"
    )

    # Slew limit
    slew_quantiles: tuple[float, float] = threshold(
        (0.75, 0.99),
        unit="of the steps",
        origin="slopes of a triangle, and of the steepest part of a sine, 8 % more than the first; "
        "single steps are noise of a recorded drive",
    )
    no_slew_limit: float = threshold(
        1e18, unit="V/s", origin="stands for infinity, which would make NaN of zero times itself"
    )


THRESHOLDS = EffectThresholds()
