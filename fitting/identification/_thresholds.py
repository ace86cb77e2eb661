"""Every number that decides in an identification, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class IdentificationThresholds:
    """Numbers that decide about starts, noise models, the verdict and faults of the recording."""

    # The fit
    solver_tolerance: float = threshold(
        1e-6, unit="scaled coordinate", origin="set by trial; far below any standard error"
    )
    solver_slope: float = threshold(
        1e-4,
        unit="cosine",
        origin="its square is the share of the cost that a step can still take away, 1e-8; of 10^4 "
        "samples 0.01 standard errors",
    )
    solver_promise: float = threshold(
        3e-9,
        unit="of the cost",
        origin="a third of 1e-8, to which costs are to agree; measured: with kinks of the noise a "
        "fifth to a half fewer steps, to the same cost within 1e-9",
    )
    solver_chi_square: float = threshold(
        0.05,
        unit="of chi-square, of white noise as large as what is left",
        origin="what a whole step may promise at the end, 0.2 standard errors; measured: where "
        "steps go from kink to kink of the noise it promises up to 0.03, and does not keep it",
    )
    drift_periods: int = threshold(
        6,
        unit="periods of one run",
        origin="set by trial; with these a creeping origin is fitted",
    )
    linear_rank: float = threshold(
        1e-10,
        unit="of the largest singular value",
        origin="set by trial; polynomial columns that are projected out are correlated, yet known "
        "to rounding, so that less counts as rank than in a Jacobian",
    )
    linear_solution_rank: float = threshold(
        1e-12,
        unit="of the largest singular value",
        origin="set by trial; as `linear_rank`, where the coefficients are solved for",
    )
    weight_rank: float = threshold(
        1e-10,
        unit="of squared columns of length 1",
        origin="half of the digits; weights of plays that act alike are shared between them",
    )
    fitted_samples: int = threshold(
        400_000,
        unit="samples of all runs",
        origin="measured, four runs of three periods: 20 000 samples take 7 s of processor time, "
        "400 000 take 10 s and 0.28 GB more memory",
    )
    lanes: int = threshold(
        1024,
        unit="fits",
        origin="memory: 1 MB each of 4 x 4000 samples; not yet tried on an accelerator",
    )
    interval_rounding: float = threshold(
        1e-15,
        unit="of the sum of squares over all samples",
        origin="rounding of a cumulative sum; a smaller one over an interval says nothing",
    )
    interval_digits: float = threshold(
        1e-6,
        unit="of the sum of squares that the linear part leaves",
        origin="rounding; with less misfit, sums over intervals have too few digits to end a fit",
    )
    interval_samples: int = threshold(
        4,
        unit="samples an interval",
        origin="measured; with fewer the samples themselves are as few",
    )
    weight_bins: int = threshold(
        100, unit="bins of the drive", origin="set by trial; branches are averaged in them"
    )
    origin_gain: float = threshold(
        0.8,
        unit="of the residual rms",
        origin="set by trial; an origin that leaves less is better. Of devices with their zero at "
        "another place the wrong one left 3 to 30 times the noise at swings of 2 V and more",
    )
    huber_corner: float = threshold(
        1.345,
        unit="standard deviations of the noise",
        origin="Huber's: 95 % efficient under normal noise",
    )
    student_degrees: float = threshold(
        4.0, unit="1", origin="usual choice; tails heavy enough for most outliers"
    )
    reweighting_rounds: int = threshold(
        60, unit="rounds", origin="set by trial: under normal noise 4 to 12 are enough"
    )
    reweighting_change: float = threshold(
        1e-5,
        unit="of the noise, rms",
        origin="a thousandth of what 10^4 readings leave unknown of a parameter",
    )
    reweighting_least: float = threshold(
        1e-6, unit="of the largest scale among runs", origin="keeps residuals of zero from dividing"
    )
    despike_samples: int = threshold(
        11, unit="samples", origin="set by trial: most of them are good where a tenth are not"
    )
    reweighting_gain: float = threshold(
        1e-6, unit="of the cost", origin="another end is better only if it gains more than rounding"
    )
    weight_bin_edge: float = threshold(
        1e-9,
        unit="of a bin",
        origin="rounding of a drive that has an offset of up to 1000 swings",
    )
    smallest_weight: float = threshold(
        0.05, unit="of the largest run weight", origin="convention; no run is left out"
    )

    # Starts
    agreement: float = threshold(
        0.1,
        unit="of the rms residual",
        origin="convention; two ends whose predictions differ by less agree, for a white residual",
    )
    agreement_misfit: float = threshold(
        0.25,
        unit="of the rms residual, times its correlation",
        origin="set by trial; a correlated residual shows a wrong model, whose near-equal ends are "
        "the rule",
    )
    agreement_exact: float = threshold(
        1e-6, unit="of the response's rms", origin="solver tolerance; less is agreement"
    )
    agreeing_starts: int = threshold(
        2, unit="starts", origin="convention; so many that end alike are enough"
    )
    same_start: float = threshold(
        1e-3, unit="1", origin="set by trial; a start so near to another one proves nothing"
    )
    guesses: int = threshold(8, unit="guesses", origin="set by trial; drawn from the data")
    start_change: float = threshold(
        1.5, unit="factor", origin="set by trial; range of random changes of a given model"
    )
    perturbations: int = threshold(
        4, unit="fits", origin="set by trial; starts near the best end where no two ends agree"
    )
    perturbation: float = threshold(
        0.05, unit="standard deviation of the logarithm", origin="set by trial"
    )
    jumps: int = threshold(
        24,
        unit="fits",
        origin="trial on four sets of seeds: where the model is wrong in ways that repeat, the "
        "kinks of plays make many near-equal ends; jumps from the best end so far end lower on "
        "average than a small change of all plays",
    )
    jump_small: float = threshold(
        0.1, unit="standard deviation of the logarithm", origin="trial, see `jumps`"
    )
    jump_medium: float = threshold(
        0.2, unit="standard deviation of the logarithm", origin="trial, see `jumps`"
    )
    jump_large: float = threshold(
        0.3, unit="standard deviation of the logarithm", origin="trial, see `jumps`"
    )
    jump_plays: int = threshold(2, unit="plays", origin="trial, see `jumps`; the others stay")
    jump_least: float = threshold(0.2, unit="logarithm", origin="trial, see `jumps`; of two plays")
    jump_most: float = threshold(1.0, unit="logarithm", origin="trial, see `jumps`; of two plays")
    misfit_correlation: float = threshold(
        0.3,
        unit="correlation of neighbouring residuals",
        origin="set by trial; above it the model is wrong and jumps are made",
    )

    # Noise model
    whole_periods: float = threshold(
        0.02, unit="samples", origin="as in a diagnosis: periods that near to whole samples count"
    )
    misfit_level: float = threshold(
        1e-3,
        unit="probability",
        origin="set by trial; below, what is left at harmonics is no noise",
    )

    # Order of the model
    order_gain: float = threshold(
        0.02,
        unit="of the held-out error",
        origin="convention; a larger model must lower it by more",
    )
    white_share: float = threshold(
        0.8,
        unit="effective over actual samples",
        origin="set by trial; above it residuals count as white and no larger model is tried",
    )

    # Verdict
    poor_gap: float = threshold(
        0.125,
        unit="of the response's rms about a straight line",
        origin="measured piezos leave up to 0.117, 59 of 60 simulated devices up to 0.105, "
        "a lag, a drift or soft clipping that spoils a scan 0.14 and more",
    )
    with_gap: float = threshold(
        1.1, unit="rmse over noise", origin="convention; a tenth more than noise is a gap"
    )
    extrapolation: float = threshold(
        6.0, unit="held-out over in-sample rmse", origin="set by trial; said however small"
    )
    exact_fit: float = threshold(
        1e-9, unit="of the span", origin="rounding; convergence of a smaller rmse is not asked for"
    )
    explained_variance: float = threshold(
        0.5, unit="of the variance", origin="convention; less explains nothing"
    )
    generalisation: float = threshold(
        3.0, unit="held-out over in-sample rmse", origin="set by trial; more does not generalise"
    )
    held_out_error: float = threshold(
        0.01, unit="of the held-out span", origin="convention; a smaller error is no failure"
    )
    changed_runs_gap: float = threshold(
        1.0, unit="times the noise", origin="convention; a smaller gap asks for no explanation"
    )
    changed_runs_first: float = threshold(
        0.5,
        unit="of the squared gap",
        origin="set by trial; large changes explain 0.7 or more to first order",
    )
    changed_runs_explained: float = threshold(
        0.95,
        unit="of the squared gap",
        origin="120 simulated devices of another make, effects up to 20 times the noise: at most "
        "0.945; changes of one or half of the runs: 0.99",
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
    exchanged_orders: int = threshold(
        40, unit="orders", origin="time; each costs a guess and a fit"
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
    outlier_rounds: int = threshold(
        3, unit="fits", origin="set by trial; large outliers hide small ones"
    )
    drive_noise_correlation: float = threshold(
        0.7,
        unit="correlation of third differences",
        origin="half of what is left from sample to sample; of 2000 samples of noise 0.03",
    )
    drive_noise_calm: float = threshold(
        6.0, unit="usual third differences of the drive", origin="four deviations of noise"
    )
    one_rate: float = threshold(
        1.2, unit="factor", origin="set by trial; rates within it show no rate dependence"
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
    clipped_steps: float = threshold(
        6.0,
        unit="steps of the digitiser",
        origin="set by trial; the reading should have moved by more meanwhile",
    )
    clipped_move: float = threshold(
        0.004,
        unit="of the response's span",
        origin="set by trial; the reading should have moved by more meanwhile",
    )
    distinct_values: float = threshold(
        0.7, unit="of the samples", origin="set by trial; with more a reading is not digitised"
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
    first_period_later: float = threshold(
        3.0, unit="times what later periods miss by", origin="convention; a drift goes on"
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

    # The paper's inverse
    inverse_order: int = threshold(
        4, unit="polynomial order", origin="set by trial; Eq. 24 at several rates or amplitudes"
    )
    inverse_order_one_loop: int = threshold(
        2,
        unit="polynomial order",
        origin="one loop cannot tell polynomial and asymmetry from plays",
    )
    inverse_samples: int = threshold(
        800, unit="samples a period", origin="set by trial; of an inverse made from a model alone"
    )
    misfit_smoothing: float = threshold(
        0.02,
        unit="of a period",
        origin="set by trial; full width at half height of the weights that smooth a misfit",
    )
    thinned_samples: int = threshold(
        500,
        unit="samples a period",
        origin="ten in the width of the smoothing of a misfit; long recordings keep as many",
    )


THRESHOLDS = IdentificationThresholds()
