r"""A Gaussian density of plays beside the identified operator, integrated out in closed form.

Plays are linear in their weights. With normal weights of standard deviation $s$ about the
operator's own, whitened errors have the covariance $I + s^2 BB'$, $B$ the responses of the plays;
the operator's own values have a flat prior and are projected out. So a richer hysteresis needs no
search, and what it may do counts as structured noise: see `MisfitCovariance`. The scale is chosen
by evidence.
"""

import dataclasses
from collections.abc import Iterable, Iterator
from itertools import groupby
from operator import itemgetter

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_lapack_funcs

from fitting.diagnosis.noise._misfit_covariance import MisfitCovariance
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit.jacobian._operator_jacobian import Linearised
from fitting.diagnosis.which.screening._base_remainder import orthonormal_basis

from ._columns import density_columns
from ._start_columns import start_columns
from ._thresholds import THRESHOLDS

_RANK = 1e-9  # of the longest direction: rounding
_LEFT_OUT = 1e-4  # of the shortest that counts: by so little may directions be none of unit length


@dataclasses.dataclass(frozen=True, eq=False)
class PlayDensity:
    """The plays' responses beyond the tangent of the base, by principal directions.

    - `tangent`: orthonormal, of the base's own values, and of what an unknown start may change, see
      `start_columns`.
    - `plays`: whitened responses, each at right angles to the tangent. `turn`: what of each of them
      gives an orthonormal direction. `power`: variance along each direction at scale 1.
    """

    tangent: Float[np.ndarray, "lines values"]
    plays: Float[np.ndarray, "lines plays"]
    turn: Float[np.ndarray, "plays rank"]
    power: Float[np.ndarray, " rank"]

    @classmethod
    def of_each_kind(cls, refit: Refit, state: State) -> Iterator["PlayDensity"]:
        """About the operator and effects of `state`: of plain plays, also finer, also bent ones.

        Plays that a device does not have cost evidence, so which of the three it is, evidence says.
        """
        whitened, base = refit.whitened, refit.base
        operator = whitened.set_values(base.operator, state.values)
        given = whitened.operator_input(state.effects)
        runs = np.asarray(given.u).shape[0]
        known = np.ones(runs, dtype=bool)
        known[: whitened.unknown_start.size] = ~whitened.unknown_start
        response = whitened.at_first_period(state.effects, state.operator_response)

        def whiten(part: np.ndarray) -> np.ndarray:
            both = Linearised(response, part)
            return whitened.jacobian_operator(refit.whitener, state.effects, both)

        moved = [refit.jacobian_base(state)]
        if not known.all():
            begins = start_columns(np.asarray(given.u), known)
            moved.append(whiten(whitened.at_first_period(state.effects, begins)))
        tangent = orthonormal_basis(np.concatenate(moved, axis=1))
        place = whitened.first_period_places(state.effects)
        found = density_columns(operator, given, known, place)
        kinds = (
            np.concatenate([whiten(part) for _, part in parts], axis=1)
            for _, parts in groupby(found, key=itemgetter(0))
        )
        return cls.growing(tangent, kinds)

    @classmethod
    def growing(
        cls,
        tangent: Float[np.ndarray, "lines values"],
        kinds: Iterable[Float[np.ndarray, "lines _"]],
    ) -> Iterator["PlayDensity"]:
        """By whitened responses of plays: of the first kind, of the first two, and so on."""
        plays, gram = np.zeros((tangent.shape[0], 0)), np.zeros((0, 0))
        for more in kinds:
            more = more[:, np.isfinite(more).all(axis=0)]
            more = more - tangent @ (tangent.T @ more)
            across = plays.T @ more
            gram = np.block([[gram, across], [across.T, more.T @ more]])
            plays = np.concatenate([plays, more], axis=1)
            yield cls(tangent, plays, *_principal_directions(gram))

    def covariance(self, scale: float) -> MisfitCovariance:
        """With weights of standard deviation `scale`, in units of the operator's mean weight."""
        variance = scale**2 * self.power
        kept = variance > THRESHOLDS.least_variance
        return MisfitCovariance(
            np.concatenate([self.tangent, self.plays @ self.turn[:, kept]], axis=1),
            np.concatenate([np.full(self.tangent.shape[1], np.inf), variance[kept]]),
        )

    def log_evidence(
        self, errors: Float[np.ndarray, " lines"], columns: Float[np.ndarray, "lines parameters"]
    ) -> Float[np.ndarray, " scales"]:
        """Logarithm of the evidence at each of `SCALES`, the best along `columns`, less a constant.

        With the prior of the scale, log-normal about the usual one.
        """
        both = np.column_stack([errors, columns])
        both = both - self.tangent @ (self.tangent.T @ both)
        along, gram = self.turn.T @ (self.plays.T @ both), both.T @ both
        out = np.empty(SCALES.size)
        for k, scale in enumerate(SCALES):
            variance = scale**2 * self.power
            left = gram - along.T @ ((variance / (1.0 + variance))[:, None] * along)
            normal, gradient = left[1:, 1:], left[1:, 0]
            gained = gradient @ np.linalg.lstsq(normal, gradient, rcond=_RANK)[0]
            out[k] = -0.5 * (left[0, 0] - gained + np.log1p(variance).sum())
        off = np.log(SCALES / THRESHOLDS.usual_scale) / THRESHOLDS.scale_spread
        return out - 0.5 * off**2


def _principal_directions(
    gram: Float[np.ndarray, "plays plays"],
) -> tuple[Float[np.ndarray, "plays rank"], Float[np.ndarray, " rank"]]:
    """`PlayDensity.turn` and `power` by the plays' products, of what can move anything.

    Plays are alike, and mostly span few directions together: a pivoted Cholesky factor of so many
    columns then leaves next to nothing of the products (Higham 2002, section 10.3), and its own
    principal directions cost little.
    """
    least = THRESHOLDS.least_variance / max(THRESHOLDS.scale_range) ** 2
    size, longest = len(gram), float(np.diag(gram).max(initial=0.0))
    if not longest > 0.0:
        return np.zeros((size, 0)), np.zeros(0)
    left_out = _LEFT_OUT * max(least, _RANK * longest) / size
    (pivoted_cholesky,) = get_lapack_funcs(("pstrf",), (gram,))
    factor, pivot, rank, _ = pivoted_cholesky(gram, tol=left_out, lower=1)
    if 2 * rank > size:
        power, turn = np.linalg.eigh(gram)
        kept = power > max(least, _RANK * float(power.max()))
        return turn[:, kept] / np.sqrt(power[kept]), power[kept]
    lower = np.zeros((size, rank))
    lower[pivot - 1] = np.tril(factor)[:, :rank]
    power, turn = np.linalg.eigh(lower.T @ lower)
    kept = power > max(least, _RANK * float(power.max()))
    return lower @ (turn[:, kept] / power[kept]), power[kept]


SCALES = np.geomspace(*THRESHOLDS.scale_range, THRESHOLDS.scales)
