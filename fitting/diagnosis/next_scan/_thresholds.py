"""Numbers that decide which hypotheses and scans are compared, and how exactly."""

import dataclasses

from rapi_jax.internal import threshold

_TRIAL = "set by trial"


@dataclasses.dataclass(frozen=True)
class NextScanThresholds:
    """Numbers that decide the next scan: hypotheses to separate, candidate scans, their power."""

    # Hypotheses.
    rivals: int = threshold(
        3, unit="hypotheses", origin=f"{_TRIAL}; separated at most; more cost time"
    )
    rival_probability: float = threshold(
        0.02, unit="probability", origin=f"{_TRIAL}; a less likely hypothesis is no rival"
    )

    # Candidate scans.
    rate_multiples: tuple[float, ...] = threshold(
        (1.0, 1.5, 2.5, 4.0, 6.5, 10.0),
        unit="fastest rate seen",
        origin=f"{_TRIAL}; about a factor of 1.6 apart, up to ten times",
    )
    inner_swing: float = threshold(
        0.8, unit="of the widest swing", origin=f"{_TRIAL}; well inside what was recorded"
    )
    same_scan: float = threshold(
        0.02,
        unit="of rate and swing",
        origin="nearer to a recorded run a scan is the same; half or double: as many candidates "
        "are left beside three sessions of triangles",
    )
    least_swing: float = threshold(
        0.12, unit="of the widest swing", origin=f"{_TRIAL}; a smaller scan shows little"
    )
    corner: float = threshold(
        0.05, unit="periods", origin=f"{_TRIAL}; half width of a smoothed triangle's corner"
    )
    limit_margin: float = threshold(
        1.0 - 1e-6, unit="of a limit", origin="rounding: the scan stays within it"
    )
    hold_times: tuple[float, ...] = threshold(
        (0.3, 3.0, 15.0), unit="s", origin=f"{_TRIAL}; at each level of a step scan"
    )
    longest_hold: float = threshold(
        100.0,
        unit="longest run",
        origin="convention: two decades of time; holds of 15 s follow runs of 0.15 s and more",
    )
    default_rate: float = threshold(
        20.0, unit="Hz", origin="a typical scan; used where no run repeats"
    )
    pause: float = threshold(60.0, unit="s", origin="a minute from the last run to the next scan")

    # Comparison of scans.
    separated_log_odds: float = threshold(
        2.944,
        unit="log odds",
        origin="ln 19: what is left to the wrong one of a pair is outside a set of 95 %",
    )
    wider: float = threshold(
        2.0, unit="of a limit", origin="what a laboratory may try next; 1.5 or 3 name the same one"
    )
    worth_wider: float = threshold(
        1.5, unit="of the log odds within the limits", origin=f"{_TRIAL}; less is no help"
    )
    most_periods: float = threshold(
        1e4, unit="periods", origin="minutes to an hour of scans; more is no plan"
    )
    least_refitted: int = threshold(
        3, unit="scans", origin=f"{_TRIAL}; whose powers are found by refits, at least"
    )
    most_refitted: int = threshold(
        6, unit="scans", origin=f"{_TRIAL}; the same at most; more cost time"
    )
    near_least_odds: float = threshold(
        4.0,
        unit="of a scan's least first-order log odds",
        origin=f"{_TRIAL}; a pair above it (and the next besides) needs no refit",
    )
    near_least_log_odds: float = threshold(
        0.1, unit="log odds", origin="one of chi-square at the calibrated temperature"
    )
    refitted_pairs: int = threshold(
        4, unit="ordered pairs", origin=f"{_TRIAL}; refitted for one scan; more cost time"
    )
    tie: float = threshold(
        0.95, unit="of the best log odds", origin=f"{_TRIAL}; a scan above it ties with the best"
    )
    shown: int = threshold(20, unit="scans", origin="in the report, best first")
    ridge: float = threshold(
        1e-11, unit="of a unit column", origin="rounding: keeps a dependent direction solvable"
    )
    recovery: float = threshold(
        1e6, unit="s", origin="before a scan: nothing of what came before is left in slow effects"
    )
    initial_state_std: float = threshold(
        0.3,
        unit="of the band",
        origin="standard deviation of an even spread, of a play's first output",
    )
    joint_steps: int = threshold(10, unit="steps", origin=f"{_TRIAL}; of one joint refit, at most")
    joint_gain: float = threshold(
        1e-2, unit="of the cost", origin=f"{_TRIAL}; a smaller decrease ends a joint refit"
    )
    joint_gain_above: float = threshold(
        1e-3, unit="of the cost", origin=f"{_TRIAL}; the same while the first order found less"
    )
    joint_gain_least: float = threshold(
        0.01, unit="chi-square", origin="far below the noise of one parameter, which is 1"
    )
    first_order_above: float = threshold(
        1.02, unit="of the first-order power", origin=f"{_TRIAL}; a cost above it is not yet there"
    )
    first_order_error: float = threshold(
        1e-2, unit="of the first-order power", origin=f"{_TRIAL}; its solution then is the minimum"
    )
    batch: int = threshold(16, unit="scans", origin=f"{_TRIAL}; evaluated together; memory")


THRESHOLDS = NextScanThresholds()
