"""Finding turns of the laser: where the fringes stop going on and come back."""

import math

import numpy as np
from scipy import ndimage

from ._corner_model import TurnFit, fit_turn, start_cost
from ._spline_model import Patch, SplineFit
from ._thresholds import THRESHOLDS


def fringes_passed(phase: np.ndarray) -> np.ndarray:
    """Fringes passed since the first value, never falling."""
    return np.maximum.accumulate(phase - phase[0]) / (2 * np.pi)


def _window(time, travel, good, at, reach):
    """Samples within `reach` fringes of sample `at`, thinned by averaging to some hundreds."""
    low = int(np.searchsorted(travel, travel[at] - reach))
    high = int(np.searchsorted(travel, travel[at] + reach, side="right"))
    part = np.arange(low, high)
    return part[good[low:high]]


def _average_groups(time, y, part, most=320):
    m = max(1, part.size // most)
    if m == 1:
        return time[part], y[part]
    n = part.size // m * m
    return time[part[:n]].reshape(-1, m).mean(axis=1), y[part[:n]].reshape(-1, m).mean(axis=1)


def turn_candidates(
    time: np.ndarray,
    phase: np.ndarray,
    travel: np.ndarray,
    low: int,
    high: int,
    keep: int = 5,
) -> list[int]:
    """Samples in `low..high` where a turn may be: bends of the phase, and the slowest fringes."""
    part = np.arange(low, high)
    fringes = max(travel[high - 1] - travel[low], 1e-3)
    lag = int(np.clip(1.5 * part.size / fringes, 4, max(4, part.size // 6)))
    a, b = np.maximum(part - lag, 0), np.minimum(part + lag, phase.size - 1)
    bend = phase[a] - 2 * phase[part] + phase[b]
    energy = ndimage.uniform_filter1d(bend**2, 2 * lag + 1, mode="nearest")
    slow = -ndimage.uniform_filter1d((phase[b] - phase[a]), 2 * lag + 1, mode="nearest")
    found: list[int] = []
    for score, many in ((energy, keep), (slow, 2)):
        left = score.copy()
        for _ in range(many):
            i = int(np.argmax(left))
            if not np.isfinite(left[i]):
                break
            found.append(int(part[i]))
            left[max(0, i - lag) : i + lag + 1] = -np.inf
    return found


def fit_spline_turns(
    time: np.ndarray,
    y: np.ndarray,
    good: np.ndarray,
    raw: np.ndarray,
    travel: np.ndarray,
    at: int,
    fringe_orders: tuple[int, ...] | None = None,
    known: SplineFit | TurnFit | None = None,
) -> tuple[list[SplineFit], float]:
    """Turns of any shape near sample `at`, the best first; each is another fringe.

    And the cost without a turn, of two branches in one direction. `fringe_orders`: the only fringes
    on which the phase may turn, where the cavity tells. `known`: an earlier fit, as another start.
    """
    part = _window(time, travel, good, at, THRESHOLDS.reach)
    if part.size < 48:
        return [], 0.0
    patch = Patch(time, y, raw, travel, at, part, _average_groups(time, y, part))
    ends = []
    for shift in (0.0, -0.6, 0.6, -1.2, 1.2):
        for fringe_order in (
            fringe_orders if fringe_orders is not None else patch.fringe_orders(shift)[:4]
        ):
            initial_coefficients = patch.initial_coefficients(shift, fringe_order)
            if initial_coefficients is None:
                continue
            p, cost = patch.fit(initial_coefficients, 5)
            ends.append((cost * (1.0 + min(patch.non_monotonicity(p), 10.0)), fringe_order, p))
    if known is not None:
        p, cost = patch.fit(patch.fit_phase(known.phase(patch.t)), 5)
        ends.append((cost * (1.0 + min(patch.non_monotonicity(p), 10.0)), 0, p))
    ends.sort(key=lambda end: end[0])
    fits: list[SplineFit] = []
    tried: list[int] = []
    for _, fringe_order, p in ends:
        if tried.count(fringe_order) >= (1 if fringe_orders is None else 2) or len(tried) >= 4:
            continue  # one of each fringe: the likeliest may be a shape that no laser has
        tried.append(fringe_order)
        p, cost = patch.fit_on(p, 25)
        if patch.non_monotonicity(p) < 0.5:
            fits.append(patch.result(p, cost))
    return sorted(fits, key=lambda fit: fit.cost), _cost_without_turn(patch)


def _cost_without_turn(patch: Patch) -> float:
    """Least cost of two branches that go on in the same direction."""
    x = (patch.t - patch.t[patch.t.size // 2]) / patch.unit
    best = np.inf
    for shift in (-1.0, 0.0, 1.0):
        before = patch.place < shift
        if before.sum() < 8 or (~before).sum() < 8:
            continue
        root = float(np.interp(shift, patch.place, x))
        one = np.polyfit(x[before] - root, patch.seen[before], 2)
        two = np.polyfit(x[~before] - root, patch.seen[~before], 2)
        start = np.array(
            [root, (one[2] + two[2]) / 2, one[1], 2 * one[0], two[1], 2 * two[0], 0.0, 1.0, 0.0]
        )
        fit = fit_turn(x, patch.y, start, rounded=False, centre=0.0, unit=1.0, steps=8)
        best = min(best, fit.cost)
    return best


def fit_parametric_turns(
    time: np.ndarray,
    y: np.ndarray,
    good: np.ndarray,
    travel: np.ndarray,
    at: int,
    spline: SplineFit,
) -> list[TurnFit]:
    """Corners, sharp and rounded by a lag, of the same fringe count as a spline, best first.

    The branches are the spline's, 1.5 fringes or more from its top.
    """
    part = _window(time, travel, good, at, THRESHOLDS.reach)
    t, values = _average_groups(time, y, part)
    centre, unit = spline.time_s, spline.unit
    x = (t - centre) / unit
    phase = spline.phase(t)
    deep = (phase.max() - phase) / (2 * np.pi)
    left, right = (x < 0) & (deep > 1.5), (x > 0) & (deep > 1.5)
    if left.sum() < 8 or right.sum() < 8:
        return []
    one, two = np.polyfit(x[left], phase[left], 2), np.polyfit(x[right], phase[right], 2)
    starts: list[tuple[float, bool, np.ndarray]] = []
    for tau in (0.0, 0.05, 0.15, 0.4, 1.0, 2.5):
        starts += _corner_starts(one, two, tau, x, values)
    fits: list[TurnFit] = []
    for rounded, many in ((False, 2), (True, 3)):
        some = sorted((s for s in starts if s[1] == rounded), key=lambda s: s[0])[:many]
        ends = [fit_turn(x, values, s[2], rounded=rounded, centre=centre, unit=unit) for s in some]
        if ends:
            best = min(ends, key=lambda fit: fit.cost)
            fits.append(
                fit_turn(
                    x, values, best.vector, rounded=rounded, centre=centre, unit=unit, final=True
                )
            )
    return fits


def fit_sharp_turn(
    time: np.ndarray,
    y: np.ndarray,
    good: np.ndarray,
    raw: np.ndarray,
    travel: np.ndarray,
    at: int,
    fringe_orders: tuple[int, ...] | None,
    known: TurnFit | SplineFit | None,
) -> list[TurnFit]:
    """The best sharp corner near sample `at`, of all on which the phase may fringe_order.

    Where the branches' phases, carried on, add up to whole fringes, they meet. `known`: an earlier
    fit, taken up again if it is a corner.
    """
    part = _window(time, travel, good, at, THRESHOLDS.reach)
    if part.size < 48:
        return []
    t, values = _average_groups(time, y, part)
    place, seen = travel[part] - travel[at], raw[part]
    centre = float(time[at])
    unit = float(time[part[-1]] - time[part[0]]) / max(place[-1] - place[0], 1.0)
    x, fine = (t - centre) / unit, (time[part] - centre) / unit
    starts: list[tuple[float, bool, np.ndarray]] = []
    for inner in (1.0, 2.5):
        before, after = place < -inner, place > inner
        if min(before.sum(), after.sum()) < 12:
            continue
        one, two = (
            np.polyfit(fine[before], seen[before], 2),
            np.polyfit(fine[after], seen[after], 2),
        )
        reach = np.polyval(np.polyadd(one, two), np.linspace(-inner - 1, inner + 1, 9))
        whole = range(
            math.ceil(reach.min() / (2 * np.pi)), math.floor(reach.max() / (2 * np.pi)) + 1
        )
        for fringe_order in whole if fringe_orders is None else fringe_orders:
            mirrored = -two
            mirrored[-1] += 2 * np.pi * fringe_order
            starts += _corner_starts(one, mirrored, 0.0, x, values)
    starts.sort(key=lambda start: start[0])
    options = [(s[2], False, centre, unit) for s in starts[:4]]
    if isinstance(known, TurnFit):
        options.append((known.vector, known.rounded, known.centre, known.unit))
    fits = [
        fit_turn((t - c) / u, values, vector, rounded=rounded, centre=c, unit=u)
        for vector, rounded, c, u in options
    ]
    fits = [f for f in fits if f.is_turn]
    if not fits:
        return []
    best = min(fits, key=lambda fit: fit.cost)
    x = (t - best.centre) / best.unit
    return [
        fit_turn(
            x,
            values,
            best.vector,
            rounded=best.rounded,
            centre=best.centre,
            unit=best.unit,
            final=True,
        )
    ]


def _corner_starts(one, two, tau, x, values) -> list[tuple[float, bool, np.ndarray]]:
    """Corners where the branch before meets the one after, less what a lag `tau` takes off."""
    slope_one, slope_two = np.polyder(one), np.polyder(two)
    gap = np.polysub(two, one)
    if tau:
        gap = np.polysub(gap, tau * np.polysub(slope_one, slope_two))
    found = []
    roots = np.roots(gap)
    for root in roots[np.abs(roots.imag) < 1e-9].real:
        if abs(root) > 4.0:
            continue
        start = np.array(
            [
                root,
                np.polyval(one, root),
                np.polyval(slope_one, root),
                2 * one[0],
                np.polyval(slope_two, root),
                2 * two[0],
                np.log(max(tau, 1e-3)),
                1.0,
                0.0,
            ]
        )
        found.append((start_cost(x, values, start, tau > 0), tau > 0, start))
    return found
