"""Numbers that decide what is wrong with a recording, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class DataCheckThresholds:
    """Numbers that decide about faults of a recording, alone or beside a fit."""

    # The fit
    fitted_samples: int = threshold(
        400_000,
        unit="samples of all runs",
        origin="measured, four runs of three periods: 20 000 samples take 7 s of processor time, "
        "400 000 take 10 s and 0.28 GB more memory",
    )
    dense_turn: float = threshold(
        16.0,
        unit="samples a turn",
        origin="noise of a reading turns a drive every 2 to 10 samples; 8: a drive averaged over "
        "8 samples passes, 32: sums of many harmonics are taken for noisy ones",
    )
    dense_samples: int = threshold(
        10_000,
        unit="samples of all runs",
        origin="measured, two cores: with so many the full search takes about 4 minutes, in "
        "proportion to them; with fewer all of it is made",
    )
    dense_fitted_samples: int = threshold(
        20_000,
        unit="samples of all runs",
        origin="measured, two cores: 40 000 samples that turn densely take 70 s with shared "
        "parameters, in proportion to them, and more than 13 minutes with a `lam` for each play",
    )

    # Verdict
    changed_runs_gap: float = threshold(
        1.0, unit="times the noise", origin="convention; a smaller gap asks for no explanation"
    )
    changed_runs_first: float = threshold(
        0.5,
        unit="of the squared gap",
        origin="set by trial; large changes explain 0.7 or more to first order",
    )
    lawful_gain: float = threshold(
        2.0,
        unit="times, either way",
        origin="a lag or a resonance changes the gain at one rate by less, a wrong unit or sign by "
        "more; half: no change of gain is left to an effect, double: one of 3 is, too",
    )
    changed_runs_explained: float = threshold(
        0.95,
        unit="of the squared gap",
        origin="120 simulated devices of another make, effects up to 20 times the noise: at most "
        "0.945; changes of one or half of the runs: 0.99",
    )
    one_run: float = threshold(
        0.9,
        unit="of a run's squared errors",
        origin="less to first order is not searched further: changed runs of 5 kinds have 0.976 or "
        "more, 24 simulated devices 0.03 to 0.996",
    )
    exchange_share: float = threshold(
        0.1,
        unit="of the squared difference that another order makes",
        origin="a smaller gap is not searched: exchanged runs leave 1.03 or more of 6 recordings, "
        "24 simulated devices 0.5 at most and 21 of them less than 0.01",
    )
    backwards_share: float = threshold(
        0.005,
        unit="of the squared difference that reading backwards makes",
        origin="the same: 0.22 of reversed samples, 0.027 of responses of the other sign, 0.0005 "
        "of the devices",
    )
    changed_runs_rounds: int = threshold(
        8, unit="refits", origin="set by trial; a gain of 1.1 is right to 1e-4 after 3"
    )
    changed_runs_step: float = threshold(1e-4, unit="of the change", origin="digits that are shown")
    changed_runs_rank: float = threshold(
        1e-9, unit="of the largest", origin="rounding; a change that the model can follow"
    )
    changed_runs_slope: float = threshold(
        0.3, unit="of the steepest", origin="convention; where the drive turns its bias shows not"
    )
    permuted_runs: int = threshold(
        4, unit="runs", origin="24 orders; of more runs only pairs and the reverse are tried"
    )
    exchanged_orders: int = threshold(40, unit="orders", origin="time; each costs a projection")
    fitted_orders: int = threshold(
        3,
        unit="orders",
        origin="each costs a guess and a fit; 24 sessions of 2 to 15 runs, most with an effect, a "
        "pair or all exchanged: to first order the right order is the best but once, then second; "
        "1 and 6 find the same of 7 faults of runs",
    )
    outlier_size: float = threshold(
        15.0,
        unit="usual distances from the median of the neighbours",
        origin="white noise reaches 8.6 in 10^6 samples; nearly twice that for heavier tails",
    )
    outlier_least: float = threshold(
        2e-3, unit="of the span", origin="set by trial; a smaller one moves no parameter"
    )
    outlier_motion: float = threshold(
        2.0,
        unit="of what the response moves from sample to sample beside it",
        origin="a model that is wrong where the response turns misses by less",
    )
    outlier_share: float = threshold(
        0.01, unit="of a run's readings", origin="convention; more are no accident"
    )
    outlier_samples: int = threshold(
        20, unit="samples", origin="set by trial; fewer have no usual distance"
    )
    drive_noise_correlation: float = threshold(
        0.7,
        unit="correlation of third differences",
        origin="half of what is left from sample to sample; of 2000 samples of noise 0.03",
    )
    drive_noise_unanswered: float = threshold(
        0.5,
        unit="of the slope of the response",
        origin="1 where the device does not follow the drive from sample to sample, 0 where it "
        "does; with drive noise of half the response's it is known to 0.05 in 1600 samples, so "
        "0.25 and 0.75 tell the two apart as well",
    )
    commanded: float = threshold(
        1e-9, unit="of the span, from sample to sample", origin="rounding of a command"
    )
    commanded_ratio: float = threshold(
        3.0,
        unit="times nearer to a triangle or a sine",
        origin="a triangle read by eight bits is off by 0.25 % of its span, a response of the "
        "paper's device by 4 %; 1.5: chance tells two measured columns apart, 6: columns with "
        "noise of 0.7 % of the span are not told",
    )
    drive_noise_calm: float = threshold(
        6.0, unit="usual third differences of the drive", origin="four deviations of noise"
    )

    # Faults of the recording
    period_miss: float = threshold(
        0.05,
        unit="of the drive's span, rms",
        origin="set by trial; a period may differ so far from the next",
    )
    period_miss_short: float = threshold(
        0.03,
        unit="of the drive's span, rms",
        origin="set by trial; the same where little more than one period was recorded",
    )
    rate_error: float = threshold(
        0.005,
        unit="of the rate",
        origin="a rate of three digits is within it; 1 % more cost 8 to 10 MHz in rms at a rate "
        "not recorded, of 75 GHz",
    )
    rate_sigmas: float = threshold(
        6.0, unit="standard errors", origin="convention; a noisy drive has no wrong rate"
    )
    several_periods: float = threshold(
        1.2, unit="periods", origin="set by trial; from these on one is compared with the next"
    )
    whole_period: float = threshold(
        0.999, unit="of a period", origin="rounding; from this on it is complete"
    )
    shorter_period_miss: float = threshold(
        0.02, unit="of the drive's span, rms", origin="set by trial; a shorter stretch repeats too"
    )
    period_divisions: int = threshold(
        8, unit="periods", origin="set by trial; a stated period may hold so many real ones"
    )
    period_samples: int = threshold(
        4, unit="samples", origin="set by trial; fewer do not show a period"
    )
    period_end_noise: float = threshold(
        4.0, unit="standard deviations", origin="set by trial; beside `period_end_least`"
    )
    period_end_least: float = threshold(
        0.08, unit="of the drive's span", origin="set by trial; one period that does not close"
    )
    period_end_most: float = threshold(
        0.9, unit="of the drive's span", origin="set by trial; more is a flyback of one sample"
    )
    clipped_samples: int = threshold(
        4, unit="samples", origin="set by trial; a shorter rest is chance"
    )
    clipped_samples_digitised: int = threshold(
        6, unit="samples", origin="set by trial; the same of a reading that is digitised coarsely"
    )
    least_period_samples: int = threshold(
        8, unit="samples", origin="convention; with fewer, branches and turns are not told apart"
    )
    equal_neighbours: float = threshold(
        0.01,
        unit="of the samples",
        origin="noise that is not digitised repeats no value; an encoder's in a public recording "
        "do in 6 %. Half and double: the same there",
    )
    clipped_steps: float = threshold(
        6.0,
        unit="steps of the digitiser",
        origin="set by trial; the reading should have moved by more meanwhile",
    )
    held_updates: int = threshold(
        20, unit="updates", origin="convention; fewer show no even interval"
    )
    held_jitter: float = threshold(
        0.2,
        unit="of the usual interval",
        origin="measured, a sensor of a joint written by a loop of uneven pace: within 0.3 all",
    )
    held_share: float = threshold(
        0.9, unit="of the updates", origin="the same sensor: 0.996 of its intervals are even"
    )
    held_steps: float = threshold(
        2.0,
        unit="steps of the digitiser",
        origin="a slow reading that is digitised changes by one step at a time",
    )
    rest_turns: float = threshold(
        0.5, unit="of the drive's turns", origin="convention; a play rests after each, a fault not"
    )
    clipped_move: float = threshold(
        0.004,
        unit="of the response's span",
        origin="set by trial; the reading should have moved by more meanwhile",
    )
    distinct_values: float = threshold(
        0.7, unit="of the samples", origin="set by trial; with more a reading is not digitised"
    )

    reading_noise: float = threshold(
        1e-9, unit="of the span", origin="rounding; a reading that changes by less has no noise"
    )
    reading_levels: int = threshold(
        8, unit="levels", origin="three bits: a step of an eighth of the span, as wide as a play"
    )

    switched_near: float = threshold(
        0.1, unit="of the drive's range", origin="convention; noise of a few percent about a level"
    )
    switched_share: float = threshold(
        0.95,
        unit="of the readings",
        origin="derivation: a sine has 0.41 of its readings so near the ends, a trapezoid that "
        "holds for a third of the period at each end 0.74; a square wave all but its edges",
    )

    # The first period
    first_period_miss: float = threshold(
        0.02,
        unit="of the span",
        origin="measured periods of a piezo close within 0.009; from rest it misses by 0.45, a "
        "servo by 0.13",
    )
    first_period_noise: float = threshold(
        8.0, unit="standard deviations", origin="convention; two readings are compared"
    )
    first_period_mean: float = threshold(
        0.02,
        unit="of a period",
        origin="a start decays over more; 0.01: noise is larger by 1.4, 0.04: a short start less",
    )
    first_period_later: float = threshold(
        3.0, unit="times what later periods miss by", origin="convention; a drift goes on"
    )
    first_period_steps: float = threshold(
        1.5,
        unit="steps of the digitiser",
        origin="two readings of one value differ by a step at most; half of one more for what the "
        "drive's last sample leaves of the period",
    )

    # Responses that turn back
    reversal_swing: float = threshold(
        0.3, unit="of the span", origin="convention; noise of a twentieth seldom swings so far"
    )
    reversal_inside: float = threshold(
        0.1,
        unit="of the drive's swing, from either end of a branch",
        origin="convention; hysteresis and lags turn the response later than the drive",
    )
    reversal_share: float = threshold(
        0.8, unit="of the branches", origin="convention; a disturbance does not recur in most"
    )

    # Jitter of the clock
    jitter_share: float = threshold(
        0.5, unit="of the fast mean square", origin="convention; most of the noise"
    )
    jitter_sigmas: float = threshold(
        4.0,
        unit="standard errors",
        origin="24 runs of 1200 samples: hidden jitter of 20 or 90 % of a step stands at 4.3 to "
        "7.2, white noise at 1.8 at most",
    )
    jitter_corner: float = threshold(
        0.1, unit="of the usual move a sample", origin="convention; where slopes change faster"
    )
    jitter_samples: int = threshold(
        200, unit="samples", origin="convention; a run with fewer shows no law of its noise"
    )

    # Sweeps and holds
    branch_swing: float = threshold(
        0.1, unit="of the swing", origin="convention; less is no branch of the drive"
    )
    hold_swing: float = threshold(
        1e-3,
        unit="of the swing",
        origin="a sine stays so near to its top for 2 % of its period; see `hold_share`",
    )
    hold_share: float = threshold(
        0.05, unit="of the run", origin="twice what a single period of a sine rests at its top"
    )
    hold_samples: int = threshold(
        20, unit="samples", origin="convention; a shorter rest shows none"
    )
    hold_sigmas: float = threshold(
        6.0, unit="standard errors", origin="convention; slow noise is not called creep"
    )
    hold_creep: float = threshold(
        2e-3, unit="of the span", origin="convention; less spoils no scan"
    )
    hold_settling: float = threshold(
        0.5,
        unit="of the rms that a logarithm of time leaves",
        origin="simulated holds: 72 of 73 with a lag or ringing leave less, 89 with creep 0.97 or "
        "more",
    )
    main_tone: float = threshold(
        0.5,
        unit="of the power",
        origin="a sawtooth has 0.61 in its first tone, a square 0.81; equal tones have less",
    )
    broadband: float = threshold(
        6.0, unit="highest over lowest frequency", origin="more than the harmonics 1, 2, 3, 5 span"
    )
    longest_lag: float = threshold(
        0.8, unit="of the record", origin="convention; a fifth is left to compare"
    )
    unstated_periods: float = threshold(
        2.0, unit="periods", origin="the second is compared with the first; its end may be cut off"
    )
    alike: float = threshold(
        0.98, unit="correlation", origin="below it the miss exceeds `shorter_period_miss`"
    )

    # Steps of the residual
    step_width_short: int = threshold(
        5, unit="samples", origin="set by trial; of the lines on either side of a step"
    )
    step_width_long: int = threshold(
        16, unit="samples", origin="set by trial; of the lines on either side of a step"
    )
    step_noise: float = threshold(
        6.0, unit="standard deviations of noise", origin="set by trial; a step is larger"
    )
    step_usual: float = threshold(
        8.0,
        unit="usual steps",
        origin="set by trial; misfit and correlated noise make steps elsewhere, a step is larger",
    )
    step_sudden: float = threshold(
        0.6, unit="of the step", origin="set by trial; one sample must bring so much of it"
    )
    step_sudden_noise: float = threshold(
        5.6, unit="standard deviations of noise", origin="set by trial; that sample against noise"
    )
    step_corner: float = threshold(
        1.5, unit="changes of slope there", origin="set by trial; a corner is not a step"
    )
    step_motion: float = threshold(
        0.4, unit="moves of the model in one sample", origin="set by trial; a step is larger"
    )
    step_motion_at_turn: float = threshold(
        2.5,
        unit="moves of the model in one sample",
        origin="set by trial; where the drive turns an unmodelled delay makes steps",
    )
    step_samples: int = threshold(40, unit="samples", origin="set by trial; fewer show no step")
    step_share: float = threshold(
        0.002, unit="of the response's span", origin="set by trial; a mode hop is larger"
    )
    step_resolution: float = threshold(
        3.0, unit="steps of the digitiser", origin="set by trial; a mode hop is larger"
    )
    drive_jump: float = threshold(
        0.25,
        unit="of the drive's swing, from one sample to the next",
        origin="derivation: a triangle of 8 samples a period, the fewest, moves by as much; half: "
        "one of fewer than 16 has no mode hop any more, double: a drive that takes two samples for "
        "its step jumps nowhere",
    )


THRESHOLDS = DataCheckThresholds()
