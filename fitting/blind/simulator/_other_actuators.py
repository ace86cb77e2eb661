"""Actuators of other families drawn at random, with loops of 5 to 25 % of their span."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ._other_hysteresis import Actuator, BoucWen, FixedPlays, inverse_plays

Array = npt.NDArray[np.float64]
PLAYS = 60
MOST_V = 2.2  # of a threshold; the usual half swing is 2.0 to 2.4


def classical(rng: np.random.Generator) -> FixedPlays:
    """A classical Prandtl-Ishlinskii operator with exponentially falling weights."""
    threshold = MOST_V * np.arange(1, PLAYS + 1) / PLAYS
    weight = np.exp(-threshold / float(rng.uniform(0.4, 1.5)))
    part = float(rng.uniform(0.25, 0.6))  # of the slope, by plays
    return FixedPlays(threshold, part * _slope(rng) * weight / weight.sum(), _line(rng, 1 - part))


def preisach(rng: np.random.Generator) -> FixedPlays:
    """A Preisach operator: densities that fall with half-width, bell-shaped in bias."""
    threshold = MOST_V * np.arange(1, PLAYS + 1) / PLAYS
    peak, wide = float(rng.uniform(0.0, 0.6)), float(rng.uniform(0.4, 1.0))
    weight = np.exp(-(((threshold - peak) / wide) ** 2))
    part = float(rng.uniform(0.25, 0.6))
    return FixedPlays(
        threshold,
        part * _slope(rng) * weight / weight.sum(),
        _line(rng, 1 - part),
        centre=3.0 + float(rng.uniform(-0.5, 0.5)) * np.ones(PLAYS),
        width=float(rng.uniform(2.0, 4.0)) * (1 + float(rng.uniform(0, 0.3)) * threshold),
    )


def maxwell_slip(rng: np.random.Generator) -> FixedPlays:
    """Eight to fifteen springs with sliders and one spring without, driven by voltage."""
    count = int(rng.integers(8, 16))
    stiffness = rng.uniform(0.5, 1.5, count) / count * float(rng.uniform(0.25, 0.8))
    slip = np.sort(rng.uniform(0.03, 1.6, count))  # displacement in V of the spring without
    straight, threshold, weight = inverse_plays(1 + stiffness.sum(), slip, -stiffness)
    slope = _slope(rng)
    return FixedPlays(threshold, slope * weight, _line(rng, straight))


def bouc_wen(rng: np.random.Generator) -> BoucWen:
    """Bouc-Wen's model of smooth loops."""
    rise, limit = float(rng.uniform(0.3, 0.7)), float(rng.uniform(0.12, 0.35))
    power = float(rng.uniform(1.0, 2.0))
    both = rise / limit**power
    fall = both * float(rng.uniform(0.5, 0.9))
    return BoucWen(rise, fall, both - fall, power, _slope(rng), _line(rng, 1.0))


FAMILIES: dict[str, Callable[[np.random.Generator], Actuator]] = {
    "bouc_wen": bouc_wen,
    "classical": classical,
    "maxwell_slip": maxwell_slip,
    "preisach": preisach,
}


def _slope(rng: np.random.Generator) -> float:
    """GHz/V, near the published device's."""
    return float(rng.uniform(12.0, 20.0))


def _line(rng: np.random.Generator, part: float) -> Array:
    """d_0 to d_3, with `part` of the slope."""
    return np.array(
        [
            rng.uniform(-60.0, -20.0),
            part * _slope(rng),
            rng.uniform(-0.6, -0.1),
            rng.uniform(0.0, 0.02),
        ]
    )
