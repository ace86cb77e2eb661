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
    refined_gain: float = threshold(
        1e-3,
        unit="of the sum of squares",
        origin="a step that gains less counts as slow, and two such end a refinement: what a check "
        "of the data explains is asked to 5 in 100; of 7 faults of runs and 4 effects the same are "
        "found with half, with double one run of the wrong sign is missed",
    )
    refined_to_bound: float = threshold(
        0.9,
        unit="of the way",
        origin="a step there: on a bound itself other values say nothing; half: the same faults",
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
    same_cost: float = threshold(
        2e-3,
        unit="of the lowest cost",
        origin="the solver's `remaining_gain`: so much a further step of a converged fit may still "
        "take away. Words alone follow from it: halved or doubled, the end of a start within that "
        "is called one of higher, or of the same, cost",
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

    # Another law of the thresholds
    law_share_left: float = threshold(
        0.5,
        unit="of the mean square that is not noise",
        origin="as in a diagnosis (`family.share_left`): of a device with one law another one "
        "leaves 0.7 of it or more; where it is the right one, 0.3 or less. Half or double: a note "
        "less or more where a large effect is beside it; nothing but the note follows",
    )

    # Verdict
    poor_gap: float = threshold(
        0.125,
        unit="of the response's rms about a straight line",
        origin="measured piezos leave up to 0.117, 59 of 60 simulated devices up to 0.105, "
        "a lag, a drift or soft clipping that spoils a scan 0.14 and more",
    )
    claim_chance: float = threshold(
        0.7,
        unit="of the variance by chance",
        origin="simulated, 4 to 12 runs that scatter by 0 to 5 times chance: intervals hold 93.9 "
        "to 97.4 %; with half of it 95.1 to 98.6, with 1 92.4 to 96.7 %",
    )
    same_swing: float = threshold(
        1.05,
        unit="factor",
        origin="convention, as for the range of a drive; a run of 5 % more swing extrapolates "
        "nothing",
    )
    claim_reach: float = threshold(
        5.0,
        unit="of the smallest and largest error of a run",
        origin="simulated, log-normal errors: at a scatter of 0.3, 0.5, 0.7, 1 intervals from two "
        "runs hold 93.6, 93.6, 92.4, 86.4 %, from four 95.3, 94.4, 95.0, 94.4 %; with 3 from two "
        "93.2, 92.1, 87.2, 78.5 %; without it they reach over nine decades",
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
    undetermined: float = threshold(
        1.0,
        unit="of the span left out, rms",
        origin="derivation: a constant at its middle is off by less than half; 0.5: a constant at "
        "its edge is still told, 2: one beyond it is called a prediction",
    )
    held_out_error: float = threshold(
        0.01, unit="of the held-out span", origin="convention; a smaller error is no failure"
    )
    outlier_rounds: int = threshold(
        3, unit="fits", origin="set by trial; large outliers hide small ones"
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
