"""The flexible base: the identified operator with a density of plays, both integrated out."""

import dataclasses
from functools import cached_property

import numpy as np

from fitting.diagnosis.noise._misfit_covariance import MisfitCovariance
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._density import SCALES, PlayDensity


@dataclasses.dataclass(frozen=True, eq=False)
class FlexibleBase:
    """A density of plays about one state, and its scale.

    `refit`: of the identified operator, all of it free. `scale`: see `PlayDensity.covariance`.
    """

    refit: Refit
    density: PlayDensity
    scale: float

    @classmethod
    def about(cls, refit: Refit, state: State) -> "FlexibleBase":
        """About `state`, with the scale of greatest evidence there."""
        errors, density = state.errors, PlayDensity.of(refit, state)
        smooth = dataclasses.replace(refit, freeze_jumps=True)  # a jump's place has no derivative
        columns = smooth.jacobian_effects(state)[: errors.synchronous.size]
        found = density.log_evidence(errors.synchronous, columns)
        found = np.where(np.isfinite(found), found, -np.inf)
        return cls(refit, density, float(SCALES[int(np.argmax(found))]))

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
            log_determinant=self.covariance.log_determinant,
        )
