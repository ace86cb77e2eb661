"""The flexible base: the identified operator with a density of plays, both integrated out."""

import dataclasses
from functools import cached_property

import numpy as np

from fitting.diagnosis.noise._misfit_covariance import MisfitCovariance
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._density import SCALES, PlayDensity
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class FlexibleBase:
    """A density of plays about one state, and its scale.

    `refit`: of the identified operator, all of it free. `scale`: see `PlayDensity.covariance`.
    `price`: chi-square that the prior odds of its kind of plays cost.
    """

    refit: Refit
    density: PlayDensity
    scale: float
    price: float

    @classmethod
    def about(cls, refit: Refit, state: State) -> "FlexibleBase":
        """About `state`, of the kind and scale of the greatest evidence there."""
        errors, densities = state.errors, list(PlayDensity.of_each_kind(refit, state))
        smooth = dataclasses.replace(refit, freeze_jumps=True)  # a jump's place has no derivative
        columns = smooth.jacobian_effects(state)[: errors.synchronous.size]
        odds = np.array([0.0, *THRESHOLDS.kind_log_odds])
        found = np.stack([one.log_evidence(errors.synchronous, columns) for one in densities])
        found = np.where(np.isfinite(found), found - odds[:, None], -np.inf)
        kind, scale = np.unravel_index(int(np.argmax(found)), found.shape)
        return cls(refit, densities[kind], float(SCALES[scale]), 2.0 * float(odds[kind]))

    @cached_property
    def covariance(self) -> MisfitCovariance:
        """Of whitened errors: what the operator's values and the plays' weights do."""
        return self.density.covariance(self.scale)

    @cached_property
    def marginal(self) -> Refit:
        """Refits of effects in which the operator's values and the plays' weights are integrated.

        The values stay where they are: what another would change is projected out to first order.
        """
        whitener = self.refit.whitener.with_misfit(self.covariance)
        base = dataclasses.replace(self.refit.base, free=np.zeros_like(self.refit.base.free))
        return dataclasses.replace(
            self.refit,
            whitener=whitener,
            base=base,
            log_determinant=self.covariance.log_determinant + self.price,
        )
