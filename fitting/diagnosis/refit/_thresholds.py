"""Numbers that steer joint refits."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class RefitThresholds:
    """Steps of the Jacobian, damping and stopping of the iteration, price of a moved jump."""

    secant_step: float = threshold(
        3e-3,
        unit="parameter value",
        origin="set by trial; before a play, and where a response jumps, the change must be larger "
        "than a kink",
    )
    fine_step: float = threshold(
        1e-6,
        unit="parameter value",
        origin="set by trial; for smooth effects behind the operator, as a tone's phase turns fast "
        "over a session",
    )
    zero_range_parts: float = threshold(
        100.0,
        unit="parts of the range between bounds",
        origin="set by trial; one part is the size taken for a parameter that is zero",
    )
    unbounded_size: float = threshold(
        1e-3, unit="1", origin="set by trial; the same for a parameter without bounds"
    )
    narrow_step_scale: float = threshold(
        0.03,
        unit="1",
        origin="set by trial; scale of the secants where no step along the wide ones descends, "
        "since a kink may be nearer than a secant is wide",
    )
    lost_readings: float = threshold(
        1e9,
        unit="spans of the readings",
        origin="rounding: of so large a response a millionth of the span is still known",
    )
    damping_trials: int = threshold(
        9, unit="trials", origin="set by trial; each with `damping_growth` times the damping before"
    )
    kept_trials: int = threshold(
        2,
        unit="trials",
        origin="the same from a Jacobian that was kept: where they fail a new one is worth more. "
        "With 9, 270 to 1270 evaluations of a diagnosis were failed trials of this kind: of four "
        "a tenth to two thirds of all",
    )
    shorter_steps: tuple[float, ...] = threshold(
        (0.3, 0.1),
        unit="of a step",
        origin="tried before more damping: a null whose base is not quite the model's ends, on the "
        "flexible base, at a chi-square a line of 1.08 (60 steps: 1.04) in place of 1.15 or 1.36, "
        "as rounding has it; with 0.1 alone at 1.13 to 1.17, with 0.03 besides the same",
    )
    step_to_bound: float = threshold(
        0.9,
        unit="of the way to a bound",
        origin="set by trial; at a bound an effect may be none, and its other parameters have no "
        "derivative",
    )
    initial_damping: float = threshold(1e-4, unit="1", origin="set by trial")
    damping_growth: float = threshold(12.0, unit="1", origin="set by trial")
    damping_decay: float = threshold(8.0, unit="1", origin="set by trial")
    least_damping: float = threshold(1e-9, unit="1", origin="set by trial")
    greatest_damping: float = threshold(1e4, unit="1", origin="set by trial")
    relative_gain: float = threshold(
        1e-4,
        unit="excess chi-square over noise",
        origin="set by trial; a smaller reduction counts as slow",
    )
    slow_steps: int = threshold(
        2, unit="steps", origin="set by trial; as many slow steps in a row end a refit"
    )
    least_gain: float = threshold(
        0.05, unit="chi-square", origin="far below what one parameter gains by chance (1)"
    )
    jump_timing_price: float = threshold(
        4.0,
        unit="chi-square",
        origin="two standard deviations, for a reading compared with the jump of its neighbour",
    )
    play_fraction: float = threshold(
        0.5, unit="band of a play", origin="middle of the band; start of an unknown initial state"
    )
    lower_bound_factor: float = threshold(
        2.0,
        unit="parameter value",
        origin="set by trial; room below a starting value that lies under its declared bound",
    )
    covariance_rcond: float = threshold(
        1e-12, unit="largest eigenvalue", origin="double precision; directions below are unknown"
    )
    finest_search_exponent: int = threshold(
        24, unit="powers of two", origin="set by trial; first step of the search of an interval"
    )
    least_row_length: int = threshold(
        512, unit="samples", origin="set by trial; a longer row saves compiling and costs memory"
    )
    columns_bucket: int = threshold(
        64, unit="columns", origin="set by trial; columns are added up to a multiple, as runs are"
    )
    run_multiple: int = threshold(
        4,
        unit="runs",
        origin="rows are added up to a multiple, to save compiling, and since XLA's code for lags "
        "of 6 and 10 rows takes 2.1 and 2.6 times as long as for 8 and 12 (4096 samples, 8 lags)",
    )


THRESHOLDS = RefitThresholds()
