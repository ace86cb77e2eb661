"""Every number that decides in the solver, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class SolverThresholds:
    """Numbers that decide about bounds, stages, convergence and rank.

    Those that enter compiled code are read when it is compiled.
    """

    inside_bound: float = threshold(
        1e-3,
        unit="of the parameter's scale",
        origin="set by trial; a start on or beyond a bound is moved so far inside",
    )
    smallest_scale: float = threshold(
        1e-100,
        unit="1",
        origin="underflow; a start nearer to zero, or to its bound, tells no typical size",
    )
    at_bound: float = threshold(
        1e-3,
        unit="of the parameter's scale",
        origin="set by trial; nearer than this a value counts as lying on its bound",
    )
    stage_steps: int = threshold(
        40, unit="steps", origin="set by trial; coordinates are scaled afresh after so many"
    )
    lane_steps: int = threshold(
        8, unit="steps", origin="most fits of ten parameters take 6 to 11; lanes at rest leave then"
    )
    lane_growth: int = threshold(
        4, unit="1", origin="measured; each number of lanes is compiled for, which takes 6 s"
    )
    slope_ridge: float = threshold(
        1e-13,
        unit="of a squared column",
        origin="rounding of a Gram matrix; without it one that is singular has no factor",
    )
    first_step_large: float = threshold(
        10.0, unit="scaled column length", origin="set by trial; the first attempt is bold"
    )
    first_step_medium: float = threshold(
        1.0, unit="scaled column length", origin="set by trial; the attempt after a failed one"
    )
    first_step_small: float = threshold(
        0.1, unit="scaled column length", origin="set by trial; the last attempt is cautious"
    )
    smallest_step_scale: float = threshold(
        1e-3, unit="scaled column length", origin="set by trial; range of the carried trust region"
    )
    largest_step_scale: float = threshold(
        1e4, unit="scaled column length", origin="set by trial; range of the carried trust region"
    )
    region_growth: float = threshold(
        0.75,
        unit="realised over predicted decrease",
        origin="textbook value; optimistix' default grows only after an almost perfect "
        "prediction and crawls in valleys",
    )
    at_rest: float = threshold(
        1e-10,
        unit="relative decrease of the cost",
        origin="set by trial; a stage that gains less has come to rest",
    )
    failed_slope: float = threshold(
        0.1,
        unit="cosine",
        origin="set by trial; at rest with a steeper slope a descent has failed",
    )
    exact_fit: float = threshold(
        1e-13,
        unit="of what the parameters make",
        origin="rounding of double precision; residuals this small are zero",
    )
    polish_steps: int = threshold(
        3, unit="steps", origin="set by trial; Gauss-Newton steps made at rest"
    )
    polish_cost_rise: float = threshold(
        1e-9,
        unit="relative rise of the cost",
        origin="rounding of small residuals brings about as much",
    )
    polish_distance: float = threshold(
        1e-3,
        unit="of 1 + |coordinate|",
        origin="set by trial; a polishing step that leads farther is a descent, not at rest",
    )
    semi_normal_correction: float = threshold(
        1e-9,
        unit="of the solution's norm",
        origin="rounding; where refinement corrects more than this, QR solves instead",
    )
    rank: float = threshold(
        1e-9,
        unit="of the largest singular value",
        origin="set by trial on redundant models; smaller ones of the column-scaled Jacobian are "
        "directions that data do not determine",
    )
    zero_column: float = threshold(
        1e-12,
        unit="of the longest column",
        origin="rounding; a shorter column of the Jacobian is zero",
    )
    null_component: float = threshold(
        0.05,
        unit="component of a unit null vector",
        origin="set by trial; with a larger one the parameter takes part in what is undetermined",
    )
    exact_null_component: float = threshold(
        1e-6,
        unit="component of a unit null vector",
        origin="rounding; with a larger one the parameter's variance is infinite",
    )
    remaining_gain: float = threshold(
        2e-3,
        unit="of the cost",
        origin="set by trial; a further step that gains less is not taken, and does not speak "
        "against convergence",
    )
    promised_gain: float = threshold(
        0.01,
        unit="of the gain below which a step is not taken",
        origin="a step that is promised less is not tried; kinks keep less than is promised, and "
        "curvature would have to give a hundred times more",
    )
    refinements: int = threshold(
        4, unit="refits", origin="set by trial; each begins where a further step leads"
    )


THRESHOLDS = SolverThresholds()
