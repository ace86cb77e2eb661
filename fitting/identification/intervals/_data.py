r"""Sums over the samples of each monotone stretch, from which residuals need no samples.

Between the contacts of plays the model is a straight line in the drive, so that all it shares with
an interval of samples is sums of powers of the drive, of the response and of the drift there:
differences of cumulative sums. They are taken once for each weighting of a recording.
"""

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.problem._linear_part import LinearPart
from rapi_jax.internal import turning_places

if TYPE_CHECKING:
    Numbers = Array
else:
    Numbers = Array | np.ndarray  # before they are put on a device


class IntervalData(eqx.Module):
    """What a residual over intervals needs, as arrays; `x` is the drive scaled to -1 to 1.

    The basis on an interval is `1, x, x^2, .., x^order`, the drift where there is one, and the
    response over `scale`. `sums` are cumulative along the nodes, of these products of two of the
    basis: `x^0` to `x^(order + 1)`, then drift and response, each by 1 and by `x`.
    """

    u: Float[Numbers, "runs nodes"]  # counted from the operator's origin
    x_of_u: tuple[Float[Numbers, ""], Float[Numbers, ""]]  # its middle and half its range
    begin: Int[Numbers, "runs stretches"]
    end: Int[Numbers, "runs stretches"]
    rises: Bool[Numbers, "runs stretches"]
    freq: Float[Numbers, " runs"]
    u_pp: Float[Numbers, " runs"]
    u_min: Float[Numbers, " runs"]
    sums: Float[Numbers, "products runs ends"]
    total: Float[Numbers, "others others"]  # products of x^2 and what follows with each other
    scale: Float[Numbers, ""]
    smallest: Float[Numbers, ""]  # a sum of squares that is no more than rounding
    linear: Float[Numbers, "runs shared rank"]  # orthonormal linear columns in the basis
    order: int = eqx.field(static=True)

    @property
    def size(self) -> int:
        """Size of the basis without the response."""
        return self.linear.shape[1]


def count_intervals(turns: int, plays: int) -> int:
    """Intervals in a row with so many stretches: a play changes its law at most twice in each."""
    return turns * (2 * plays + 1)


@dataclasses.dataclass(frozen=True, eq=False)
class Stretched:
    """The nodes of a recording as the operator sees them: scaled, with their monotone stretches."""

    u: np.ndarray  # "runs nodes", counted from the operator's origin
    u_min: np.ndarray  # "runs"
    begin: np.ndarray  # "runs stretches"
    end: np.ndarray
    middle: float
    half: float

    @classmethod
    def of(cls, u: np.ndarray, u_min: np.ndarray) -> "Stretched":
        """The stretches of the drives `u`, one per row; rows with fewer end with empty ones."""
        turns = [turning_places(row) for row in u]
        begin = np.zeros((len(u), 1 + max(t.size for t in turns)), dtype=np.int32)
        for row, found in enumerate(turns):
            begin[row, 1 : 1 + found.size] = found
            begin[row, 1 + found.size :] = u.shape[1]
        last = np.full((len(u), 1), u.shape[1], dtype=np.int32)
        low, high = float(u.min()), float(u.max())
        half = (high - low) / 2.0 or 1.0
        end = np.concatenate([begin[:, 1:], last], axis=1)
        return cls(u, u_min, begin, end, (low + high) / 2.0, half)

    @property
    def x(self) -> np.ndarray:
        """The drive scaled to -1 to 1."""
        return (self.u - self.middle) / self.half

    @property
    def rises(self) -> np.ndarray:
        """Whether the drive rises in each stretch."""
        last = self.u.shape[1] - 1
        first, final = np.minimum(self.begin, last), np.maximum(self.end - 1, 0)
        ends = (np.take_along_axis(self.u, at, axis=1) for at in (first, final))
        return np.greater(*reversed(list(ends)))

    def powers(self, power: int) -> np.ndarray:
        """The coefficients of `u^power` in powers of `x`."""
        k = np.arange(power + 1)
        choose = np.array([math.comb(power, int(i)) for i in k])
        return choose * self.half**k * self.middle ** (power - k)

    def data(
        self,
        fields: dict[str, np.ndarray],
        *,
        y: Float[np.ndarray, "runs time"],
        weight: Float[np.ndarray, "runs time"],
        drift: Float[np.ndarray, "runs time"] | None,
        linear: LinearPart,
        shares: Float[np.ndarray, "runs shared linear"],
        order: int,
    ) -> IntervalData:
        """Sums for `y`, the response less what is neither linear nor of plays; NumPy arrays.

        `fields`: those of `DriveBatch`. `shares`: the linear columns in the basis of each run.
        """
        in_basis = shares @ linear.whitening
        coefficients = in_basis @ (linear.whitening.T @ (linear.columns.T @ (weight * y).ravel()))
        place = fields["place"]
        x = np.take_along_axis(self.x, place, axis=1)
        rest = y - _combine(x, coefficients[:, : order + 1])
        if drift is not None:
            rest -= coefficients[:, -1:] * drift
        square = weight**2
        scale = np.sqrt(float(np.sum(square * rest**2)) / max(float(square.sum()), 1e-300)) or 1.0
        extra = [*([] if drift is None else [drift]), rest / scale]
        powers = [square]
        while len(powers) < order + 2:
            powers.append(powers[-1] * x)
        products = powers + [
            product for one in extra for product in (powers[0] * one, powers[1] * one)
        ]
        columns = [weight * x**2]
        while len(columns) < order - 1:
            columns.append(columns[-1] * x)
        columns = columns[: max(order - 1, 0)] + [weight * one for one in extra]
        others = np.stack([column.ravel() for column in columns])
        arrays: dict[str, Any] = dict(
            u=self.u,
            x_of_u=(np.asarray(self.middle), np.asarray(self.half)),
            begin=self.begin,
            end=self.end,
            rises=self.rises,
            freq=fields["freq"],
            u_pp=fields["u_pp"],
            u_min=self.u_min,
            sums=self._cumulative(products, place),
            total=others @ others.T,
            scale=np.asarray(scale),
            smallest=np.asarray(THRESHOLDS.interval_rounding * float(square.sum())),
            linear=in_basis,
        )
        return IntervalData(**arrays, order=order)

    def _cumulative(
        self, products: list[np.ndarray], place: Int[np.ndarray, "runs time"]
    ) -> Float[np.ndarray, "products runs ends"]:
        """Sums along the nodes, 0 first, of products that are given at the samples of the runs."""
        runs, nodes = self.u.shape
        sums = np.zeros((len(products), runs, nodes + 1))
        direct = place.shape[1] == nodes and (place == np.arange(nodes)).all()
        at = None if direct else (place + (nodes * np.arange(runs))[:, None]).ravel()
        for out, product in zip(sums[:, :, 1:], products, strict=True):
            if at is not None:
                product = np.bincount(at, product.ravel(), minlength=runs * nodes)
            np.cumsum(product.reshape(runs, nodes), axis=1, out=out)
        return sums


def _combine(x: Float[np.ndarray, "runs time"], coefficients: np.ndarray) -> np.ndarray:
    """Polynomials in `x`, one per row, their coefficients from the constant on."""
    total = np.zeros_like(x)
    for one in coefficients.T[::-1]:
        total *= x
        total += one[:, None]
    return total
