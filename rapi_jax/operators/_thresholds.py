"""Thresholds of the operators: initial guesses, what data determine, the flexible form."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class OperatorThresholds:
    """Numbers that decide where fits begin and how far a flexible hysteresis may go."""

    guess_samples: int = threshold(
        256,
        unit="samples a run",
        origin="plays feel the turning points alone, and these are kept; more costs time",
    )
    guess_trials: int = threshold(
        384, unit="shapes", origin="set by trial; more costs time, fewer miss the basin"
    )
    alpha_range: tuple[float, float] = threshold(
        (0.03, 0.9), unit="1", origin="what piezo devices show; drawn evenly in the logarithm"
    )
    growth_range: tuple[float, float] = threshold(
        (0.0, 0.6),
        unit="of the widest threshold, at the highest rate",
        origin="what piezo devices show",
    )
    lam_range: tuple[float, float] = threshold(
        (0.4, 2.5), unit="1", origin="what piezo devices show; drawn evenly in the logarithm"
    )
    guess_symmetry: float = threshold(
        1.1,
        unit="lam, or one over it",
        origin="plays nearer to 1 count as symmetric: of one simulated device all guesses from "
        "1.004 up to there ended where those below 1 did, at 1300 of chi-square a line, and 1.62 "
        "at 1.3",
    )
    lam_shared: int = threshold(
        4, unit="trials", origin="set by trial: every fourth trial has symmetric plays"
    )
    decay_range: tuple[float, float] = threshold(
        (-0.5, 3.0), unit="2 / peak-to-peak drive", origin="what piezo devices show"
    )
    decay_absent: int = threshold(
        3, unit="trials", origin="set by trial: every third trial has equal weights"
    )
    origin_reach: float = threshold(
        4.0,
        unit="of the drives' whole range",
        origin="measured recordings at hand have their zero within 1.7 ranges; much farther off "
        "the parameters of falling bounds that count from it are not determined",
    )
    origin_below: float = threshold(
        1.0 / 6.0,
        unit="of the drives' whole range",
        origin="the paper's drive as reconstructed, 4.5 V peak to peak about 3 V, starts so far "
        "above zero",
    )
    amplitude_digits: int = threshold(
        6, unit="decimals of a volt", origin="set by trial: amplitudes that agree so far are one"
    )
    inverse_levels: int = threshold(
        2001, unit="drive levels a branch", origin="set by trial: to look frequencies up in"
    )
    inverse_origin: float = threshold(
        1.1,
        unit="spans above the lowest frequency",
        origin="where fits ended best: near the top the bands that the falling branch meets first "
        "are narrow",
    )
    inverse_even_width: float = threshold(
        0.3, unit="spans", origin="set by trial: the widest of evenly spread thresholds"
    )
    inverse_lam_falls: tuple[float, ...] = threshold(
        (1.2, 0.9, 1.5, 0.6),
        unit="of ln lam, first play to last",
        origin="where fits ended best: lam makes up for the forward polynomial's slope",
    )
    inverse_lam_range: tuple[float, float] = threshold(
        (0.1, 10.0), unit="1", origin="set by trial: keeps guesses within the bounds of lam"
    )
    inverse_exponent: float = threshold(
        2.0, unit="1", origin="set by trial: largest power of the law of weights to start from"
    )
    inverse_narrowest: float = threshold(
        0.05, unit="of the median threshold", origin="set by trial: keeps thresholds positive"
    )
    flexible_plays: int = threshold(
        24, unit="plays", origin="set by trial; larger costs time, smaller absorbs less hysteresis"
    )
    flexible_order: int = threshold(
        4, unit="powers of the drive", origin="one more than the usual polynomial"
    )
    flexible_reach: float = threshold(
        1.6, unit="of the widest threshold identified", origin="set by trial"
    )
    flexible_threshold: float = threshold(
        0.25, unit="of a threshold, standard deviation", origin="set by trial"
    )
    flexible_threshold_least: float = threshold(
        1e-3, unit="of alpha, standard deviation", origin="set by trial: a play at zero may move"
    )
    flexible_lam: float = threshold(0.3, unit="1, standard deviation", origin="set by trial")
    flexible_eta: float = threshold(0.4, unit="1, standard deviation", origin="set by trial")
    flexible_weight: float = threshold(
        0.5, unit="of the largest weight, standard deviation", origin="set by trial"
    )
    flexible_weight_least: float = threshold(
        1e-3,
        unit="of the response's span over the drive's, standard deviation",
        origin="a play of so little is lost in noise; matters where a fit has no hysteresis at all",
    )
    flexible_decay: tuple[float, float] = threshold(
        (0.4, 0.2),
        unit="of a weight's logarithm at the widest threshold, standard deviation",
        origin="set by trial",
    )
    flexible_growth: float = threshold(
        0.3, unit="of zeta, standard deviation among plays", origin="set by trial"
    )
    flexible_growth_least: float = threshold(
        1e-4, unit="V/Hz, standard deviation", origin="set by trial: a growth of zero may move"
    )
    flexible_curvature: float = threshold(
        0.07,
        unit="of the falling bound's slope, half a swing from the middle, standard deviation",
        origin="set by trial",
    )


THRESHOLDS = OperatorThresholds()
