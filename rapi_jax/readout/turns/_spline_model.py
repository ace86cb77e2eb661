"""A turn of any shape: a spline of phase through the fringes, whatever rounded the corner."""

import dataclasses

import numpy as np
from scipy import interpolate

from rapi_jax.readout._levenberg_marquardt import levenberg_marquardt

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class SplineFit:
    """A turn as a cubic spline of phase; rises before and falls after, by convention.

    Fields as in `TurnFit`; `rounding_s` is the time that a first-order lag would need to bend the
    phase as sharply as this one.
    """

    spline: interpolate.BSpline
    low: float
    high: float
    unit: float
    time_s: float
    stderr_s: float
    rounding_s: float
    cost: float
    count: int
    free: int
    amplitude: float
    offset: float

    @property
    def misfit(self) -> float:
        """Mean squared residual of the normalised fringes."""
        return self.cost / max(1, self.count)

    def phase(self, time: np.ndarray) -> np.ndarray:
        """Phase at `time` (s), rad."""
        inside = np.clip(time, self.low, self.high)
        return self.spline(inside) + self.spline.derivative()(inside) * (time - inside)

    def rate_hz(self, time: np.ndarray) -> np.ndarray:
        """Fringe rate at `time` (s), with sign, Hz."""
        return self.spline.derivative()(np.clip(time, self.low, self.high)) / (2 * np.pi)


class Patch:
    """One window around a suspected turn: its samples, spline basis and unwrapped phase."""

    def __init__(self, time, y, raw, travel, at, part, thinned):
        self.t, self.y = thinned
        self.low, self.high = float(self.t[0]), float(self.t[-1])
        here = travel[part] - travel[at]
        fine = np.arange(
            -THRESHOLDS.dense_half_width,
            THRESHOLDS.dense_half_width + 1e-9,
            THRESHOLDS.dense_spacing,
        )
        wide = np.arange(
            THRESHOLDS.dense_half_width + THRESHOLDS.wide_spacing,
            max(THRESHOLDS.wide_half_width, here[-1]),
            THRESHOLDS.wide_spacing,
        )
        places = np.concatenate([-wide[::-1], fine, wide])
        places = places[(places > here[0] + 0.6) & (places < here[-1] - 0.6)]
        clock = np.interp(places, here + 1e-6 * np.arange(here.size), time[part])
        clock = clock[np.concatenate([[True], np.diff(clock) > 1e-3 * (self.high - self.low)])]
        self.knots = np.concatenate([[self.low] * 4, clock, [self.high] * 4])
        self.basis = self._design(self.t)
        self.count = self.basis.shape[1]
        self.unit = (self.high - self.low) / max(here[-1] - here[0], 1.0)
        self.seen = np.interp(self.t, time[part], raw[part])
        self.place = np.interp(self.t, time[part], here)
        third = np.diff(np.eye(self.count), 3, axis=0)
        self.rough = third.T @ third

    def _design(self, t):
        inside = np.clip(t, self.low, self.high)
        return interpolate.BSpline.design_matrix(inside, self.knots, 3).toarray()

    def fringe_orders(self, shift: float) -> list[int]:
        """Twice the fringe on which the phase may fold at `shift`, the likeliest first."""
        sides = self._sides(shift)
        if sides is None:
            return []
        turn = float(np.interp(shift, self.place + 1e-9 * np.arange(self.t.size), self.t))
        near = [np.polyfit(self.t[s] - turn, self.seen[s], 1)[1] for s in self._near(sides)]
        meet = float(sum(near)) / (2 * np.pi)
        return sorted(range(round(meet) - 2, round(meet) + 3), key=lambda m: abs(m - meet))

    def _sides(self, shift: float) -> tuple[np.ndarray, np.ndarray] | None:
        before, after = self.place < shift - 1.1, self.place > shift + 1.1
        return (before, after) if min(before.sum(), after.sum()) >= 12 else None

    def _near(self, sides):
        before, after = (np.flatnonzero(side) for side in sides)
        return before[-30:], after[:30]

    def initial_coefficients(self, shift: float, fringe_order: int) -> np.ndarray | None:
        """Coefficients through the phase before the turn, and through its mirror image after it.

        `shift`: where the turn is taken to be, fringes from the centre. What is within 1.1 fringes
        of it is left to smoothness.
        """
        sides = self._sides(shift)
        if sides is None:
            return None
        before, after = sides
        target = np.where(before, self.seen, 2 * np.pi * fringe_order - self.seen)
        use = before | after
        b = self.basis[use]
        return np.linalg.solve(b.T @ b + 1e-3 * self.rough, b.T @ target[use])

    def fit_phase(self, phase: np.ndarray) -> np.ndarray:
        """Coefficients through a phase given at every sample."""
        b = self.basis
        return np.linalg.solve(b.T @ b + 1e-6 * self.rough, b.T @ phase)

    def non_monotonicity(self, p: np.ndarray) -> float:
        """Phase (rad) by which a solution falls before its top and rises after it."""
        step = np.diff(self.basis @ p[:-2])
        top = int(np.argmax(self.basis @ p[:-2]))
        return float(-np.minimum(step[:top], 0).sum() + np.maximum(step[top:], 0).sum())

    def fit(self, start: np.ndarray, steps: int) -> tuple[np.ndarray, float]:
        """Least squares on the fringes from `start`; coefficients, then amplitude and offset."""
        return self.fit_on(np.concatenate([start, [1.0, 0.0]]), steps)

    def fit_on(self, p: np.ndarray, steps: int) -> tuple[np.ndarray, float]:
        """The same from all parameters."""
        found = levenberg_marquardt(
            self._model, self.y, p, steps=steps, tolerance=1e-4, penalty=self._penalty()
        )
        return found.parameters, float(found.residual @ found.residual)

    def _penalty(self):
        """Of rough splines: on third differences of the coefficients, a trace of it."""
        penalty = np.zeros((self.count + 2, self.count + 2))
        penalty[:-2, :-2] = 1e-5 * self.rough
        return penalty

    def _model(self, p):
        phase = self.basis @ p[:-2]
        jac = np.empty((self.t.size, p.size))
        jac[:, :-2] = (-p[-2] * np.sin(phase))[:, None] * self.basis
        jac[:, -2] = np.cos(phase)
        jac[:, -1] = 1.0
        return p[-2] * np.cos(phase) + p[-1], jac

    def _span(self, when: float) -> np.ndarray:
        """The knot interval that holds a time."""
        edges = np.unique(self.knots)
        return np.array([np.clip(np.searchsorted(edges, when) - 1, 0, edges.size - 2)])

    def result(self, p: np.ndarray, cost: float) -> SplineFit:
        """The fitted spline with the time at which its rate passes zero, and that time's error."""
        spline = interpolate.BSpline(self.knots, p[:-2], 3)
        rate = spline.derivative()
        grid = np.linspace(self.low, self.high, 400)
        top = int(np.argmax(spline(grid)))
        a, b = grid[max(top - 1, 0)], grid[min(top + 1, grid.size - 1)]
        for _ in range(50):
            middle = (a + b) / 2
            a, b = (middle, b) if rate(middle) > 0 else (a, middle)
        when = float((a + b) / 2)
        bend = float(rate.derivative()(when))
        value, jac = self._model(p)
        error = self.y - value
        bread = np.linalg.pinv(jac.T @ jac + self._penalty(), hermitian=True)
        scores = jac * error[:, None]
        covariance = (
            bread @ (scores.T @ scores) @ bread * error.size / max(1, error.size - self.count)
        )
        width = 1e-4 * (self.high - self.low)
        lever = (self._design(np.array([when + width])) - self._design(np.array([when - width])))[
            0
        ] / (2 * width)
        slope_error = float(np.sqrt(max(lever @ covariance[:-2, :-2] @ lever, 0.0)))
        spacing = float(np.min(np.diff(np.unique(self.knots))[self._span(when)]))
        slope_error = float(np.hypot(slope_error, THRESHOLDS.spline_shape_error / spacing))
        stderr = slope_error / max(abs(bend), 1e-30)
        ends = float(rate(self.low) - rate(self.high))
        rounding = ends / max(abs(bend), 1e-30) if ends > 0 else 0.0
        return SplineFit(
            spline,
            self.low,
            self.high,
            self.unit,
            when,
            stderr,
            rounding,
            cost,
            int(self.t.size),
            int(p.size),
            float(p[-2]),
            float(p[-1]),
        )
