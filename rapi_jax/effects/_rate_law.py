"""How thresholds grow with the scan rate, beyond Eq. 11."""

from collections.abc import Iterable
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from .base._contribution import Contribution
from .base._effect import AbstractEffect
from .base._law import AbstractLawEffect, Law
from .base._residual_summary import ResidualSummary

_SAME_RATE = 1e-6  # of a rate
REFERENCE = 10.0  # Hz, f_0: where every exponent gives the same threshold


class RateLaw(AbstractLawEffect):
    r"""Thresholds that grow as a power of the scan rate: $\zeta f_0 (f / f_0)^m$ for $\zeta f$.

    $f_0$ is 10 Hz, so that $\zeta$ keeps its meaning there. Eq. 11 has $m = 1$; piezos that are
    viscous or that creep show 0.2 to 2.6. At rate 0 the term is zero for every $m$.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Law, RateLaw
    >>> law = Law.of(jnp.array(40.0), jnp.array(4.5))  # Hz, V peak to peak
    >>> float(RateLaw.at(exponent=1.0)(law, jnp.array(3.0)).freq)  # 1: proportional to the rate
    40.0
    """

    exponent: Float[Array, ""] = parameter(unit="1", default=1.0, bounds=(0.0, 3.0))  # m

    name: ClassVar[str] = "rate_law"
    label: ClassVar[str] = "another law of thresholds with scan rate"

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """Exponents; none where there is one rate, at which `zeta` takes all of it."""
        rates = {round(rate, 9) for rate in summary.rates if rate > 0}
        return [cls.at(exponent=m) for m in (0.4, 0.7, 1.3, 1.6, 2.3)] if len(rates) > 1 else []

    @float64
    def __call__(self, law: Law, bias: Float[Array, ""]) -> Law:
        del bias
        moves = law.freq > 0
        ratio = jnp.where(moves, law.freq, REFERENCE) / REFERENCE
        grown = law.freq * jnp.exp((self.exponent - 1.0) * jnp.log(ratio))
        return law._replace(freq=jnp.where(moves, grown, law.freq))

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """A threshold of its own at each rate; none below three, which the equation can do."""
        rates = np.unique(np.round(here.rates[here.rates > 0], 9))
        if rates.size < 3:
            return []
        grown = REFERENCE * (rates / REFERENCE) ** float(self.exponent)  # what follows it sees
        shifts = [_RateShift.at(at_hertz=rate, shift=0.1 * rate) for rate in grown]
        return [here.scaled(np.stack([here.beside(shift) for shift in shifts]))]


class _RateShift(AbstractLawEffect):
    """At one rate, thresholds as at another."""

    at_hertz: Float[Array, ""] = parameter(unit="Hz", default=0.0, held=True)
    shift: Float[Array, ""] = parameter(unit="Hz", default=0.0)
    name: ClassVar[str] = "rate_shift"

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """None: it is a part of another effect's forms."""
        del summary
        return []

    @float64
    def __call__(self, law: Law, bias: Float[Array, ""]) -> Law:
        del bias
        here = jnp.abs(law.freq - self.at_hertz) < _SAME_RATE * self.at_hertz
        return law._replace(freq=law.freq + jnp.where(here, self.shift, 0.0))
