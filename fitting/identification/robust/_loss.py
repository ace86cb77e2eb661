r"""Losses: what a residual costs, by the weight that least squares would have to give it.

`z` is a residual in units of the noise's scale, $\psi$ the derivative of its cost, $\psi(z)/z$ its
weight (P. J. Huber and E. M. Ronchetti, Robust Statistics, 2nd ed., Wiley 2009, chapters 4 and 7).
"""

import abc

import equinox as eqx
import numpy as np
from jaxtyping import Float

from fitting.identification._thresholds import THRESHOLDS


class AbstractLoss(eqx.Module):
    """A cost of residuals, convex or not, that grows more slowly than their squares."""

    @abc.abstractmethod
    def weight(self, z: Float[np.ndarray, "*samples"]) -> Float[np.ndarray, "*samples"]:
        """The weight of each residual, 1 at zero or near it."""

    @abc.abstractmethod
    def slope(self, z: Float[np.ndarray, "*samples"]) -> Float[np.ndarray, "*samples"]:
        r"""The derivative of $\psi$, by which a small change of the model changes $\psi$."""

    @property
    def normal_rms(self) -> float:
        r"""The rms of $\psi$ under standard normal noise."""
        z = np.linspace(-8.0, 8.0, 4001)
        density = np.exp(-(z**2) / 2.0)
        return float(np.sqrt(density @ (z * self.weight(z)) ** 2 / density.sum()))


class Huber(AbstractLoss):
    r"""Squares up to $k$, straight lines beyond: $\psi(z) = \max(-k, \min(z, k))$."""

    corner: float  # k

    def weight(self, z):
        size = np.abs(z)
        return np.where(size > self.corner, self.corner / np.maximum(size, self.corner), 1.0)

    def slope(self, z):
        return (np.abs(z) <= self.corner).astype(float)


class Student(AbstractLoss):
    r"""The likelihood of Student's t: $\psi(z) = (\nu + 1) z / (\nu + z^2)$, over its slope at 0.

    Readings count less the farther off they are, in the end not at all.
    """

    degrees: float  # nu

    def weight(self, z):
        return 1.0 / (1.0 + z**2 / self.degrees)

    def slope(self, z):
        square = z**2 / self.degrees
        return (1.0 - square) / (1.0 + square) ** 2


LOSSES = ("squares", "huber", "student")


def loss_of(name: str) -> AbstractLoss | None:
    """The loss of this name; `None` for squares. `ValueError` for another name."""
    if name not in LOSSES:
        raise ValueError(
            f'Argument `loss` must be "squares", "huber" or "student", but is {name!r}.'
        )
    return {
        "squares": None,
        "huber": Huber(THRESHOLDS.huber_corner),
        "student": Student(THRESHOLDS.student_degrees),
    }[name]
