"""A coarsely sampled drive between its samples: corners, smooth turns, and even finer places.

Effects follow the drive in time: what a low-pass does to a sine of 60 samples a period is missed by
5 % where the drive is straight between them. So the pieces between corners are drawn through their
samples by cubic splines.
"""

import numpy as np
from jaxtyping import Float

from ._corners import Corners, bends, between, within_period, wrapped
from ._thresholds import THRESHOLDS


def nodes_between_samples(
    value: Float[np.ndarray, " time"], samples_a_period: float, *, finer: bool
) -> Corners:
    """Places, in steps from the first sample, and values of the nodes between a drive's samples.

    Its corners; where it has fewer than `smooth_nodes` samples a period, also the vertices of
    smooth turns and, with `finer`, as many even places as then make so many nodes. Straight pieces
    get places up to `straight_nodes`; those that are neither straight nor smooth, such as measured
    noise, get none. How a drive that does not repeat goes on between its samples is not known: give
    0 of them a period.
    """
    at, height = bends(value)
    new, levels = between(at, height)
    if not 0 < samples_a_period < THRESHOLDS.smooth_nodes:
        return new, levels
    smooth, straight = (
        _even_places(value.size, nodes / samples_a_period if finer else 1.0, new)
        for nodes in (THRESHOLDS.smooth_nodes, THRESHOLDS.straight_nodes)
    )
    found = [(new, levels)]
    own = np.arange(value.size, dtype=float)
    knots = np.concatenate([own, new])
    order = np.argsort(knots)
    knots, levels = knots[order], np.concatenate([value, levels])[order]
    ends = np.concatenate([[0.0], at, own[-1:]])
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        inside = slice(*np.searchsorted(knots, [begin - 1e-9, end + 1e-9]))
        x, y = knots[inside], levels[inside]
        if _is_straight(y, float(np.ptp(value))):
            places = straight[slice(*np.searchsorted(straight, [begin, end]))]
            found.append((places, np.interp(places, x, y)))
        elif x.size >= THRESHOLDS.spline_knots and _is_smooth(y):
            found.append(_on_curve(x, y, smooth[slice(*np.searchsorted(smooth, [begin, end]))]))
    places, values = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(places)
    return places[order], values[order]


def periodic_nodes_between_samples(value: Float[np.ndarray, " time"], *, finer: bool) -> Corners:
    """The same of one period of a drive, from 0 on."""
    beside = min(THRESHOLDS.spline_margin, value.size)
    at, height = nodes_between_samples(wrapped(value, beside), float(value.size), finer=finer)
    return within_period(at - beside, height, value.size)


def _even_places(
    samples: int, parts: float, corners: Float[np.ndarray, " corners"]
) -> Float[np.ndarray, " places"]:
    """Places that divide each step into at least so many parts, but for those at corners."""
    whole = max(1, int(np.ceil(parts)))
    places = (np.arange(samples - 1)[:, None] + np.arange(1, whole) / whole).ravel()
    return places[~_is_near(places, corners)]


def _on_curve(
    knots: Float[np.ndarray, " knots"],
    levels: Float[np.ndarray, " knots"],
    places: Float[np.ndarray, " places"],
) -> Corners:
    """`places` on the cubic spline through one piece without corners, and its vertices."""
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(knots, levels)
    turns = curve.derivative().roots(extrapolate=False)
    turns = turns[(turns > knots[0]) & (turns < knots[-1])]
    turns = between(turns, turns)[0]
    places = np.concatenate([places[~_is_near(places, turns)], turns])
    return places, curve(places)


def _is_straight(levels: Float[np.ndarray, " knots"], swing: float) -> bool:
    """Whether a piece of even samples bends by next to nothing."""
    bend = np.abs(np.diff(levels[1:-1], 2)).max(initial=0.0)
    return bool(bend <= THRESHOLDS.straight_bend * swing)


def _is_smooth(levels: Float[np.ndarray, " knots"]) -> bool:
    """Whether the fourth differences of even samples are small beside the second ones."""
    second, fourth = (np.diff(levels[1:-1], k) for k in (2, 4))
    if not fourth.size:
        return False
    return bool(np.mean(fourth**2) <= THRESHOLDS.smooth_differences**2 * np.mean(second**2))


def _is_near(
    places: Float[np.ndarray, " places"], others: Float[np.ndarray, " others"]
) -> np.ndarray:
    """Whether each place is one of `others`, which are sorted, but for rounding."""
    if not others.size:
        return np.zeros(places.shape, dtype=bool)
    others = np.sort(others)
    after = np.clip(np.searchsorted(others, places), 0, others.size - 1)
    far = np.minimum(
        np.abs(others[after] - places), np.abs(others[np.maximum(after - 1, 0)] - places)
    )
    return far <= THRESHOLDS.same_node
