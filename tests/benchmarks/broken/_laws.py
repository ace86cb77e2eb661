"""Equations and laws."""

from ._mutation import Mutation

LAWS = (
    Mutation(
        "Eq. 9: the play's upper bound taken for its lower one",
        "rapi_jax/plays/_play.py",
        "    value = jnp.maximum(lower, jnp.minimum(upper, value))  # Eq. (9)",
        "    value = jnp.maximum(upper, jnp.minimum(lower, value))  # Eq. (9)",
        "tests/rapi_jax/plays",
    ),
    Mutation(
        "Eq. 14: the weights of the plays lost",
        "rapi_jax/plays/_play.py",
        "    return _values(*_bands(u, r, lam, eta, bow, u_0), start) @ p",
        "    return _values(*_bands(u, r, lam, eta, bow, u_0), start) @ jnp.ones_like(p)",
        "tests/rapi_jax/plays tests/rapi_jax/operators",
    ),
    Mutation(
        "Eq. 11: a threshold that falls with the rate",
        "rapi_jax/operators/_rapi.py",
        "* self.rank * u_pp / 2.0 + self.zeta * freq  # Eq. (11)",
        "* self.rank * u_pp / 2.0 - self.zeta * freq  # Eq. (11)",
        "tests/rapi_jax/operators",
    ),
    Mutation(
        "whitening: the other half of the spectrum is called synchronous",
        "fitting/diagnosis/noise/_lines.py",
        "        synchronous = k % block.periods == 0",
        "        synchronous = k % block.periods != 0",
        "tests/fitting/diagnosis/noise tests/fitting/diagnosis/where",
    ),
    Mutation(
        "metrics: rising and falling branch exchanged",
        "rapi_jax/_metrics.py",
        "return Linearity(sides[0][0], sides[1][0], sides[0][1], sides[1][1], (low, high))",
        "return Linearity(sides[1][0], sides[0][0], sides[1][1], sides[0][1], (low, high))",
        "tests/rapi_jax/test_metrics.py",
    ),
    Mutation(
        "cross-validation: one period more is held out",
        "fitting/identification/assessment/_cross_validation.py",
        "            first = periods - max(1, round(periods / 3))",
        "            first = periods - max(1, round(periods / 3)) - 1",
        "tests/fitting/identification/test_cross_validation.py",
    ),
    Mutation(
        "steps behind a lag: matched as if the lag led",
        "rapi_jax/effects/base/_linear_path.py",
        "np.fft.rfft(part) * np.conj(transfer)",
        "np.fft.rfft(part) * transfer",
        "tests/rapi_jax/effects/test_guesses_behind_lags.py",
    ),
    Mutation(
        "saturation: a corner in the middle of its step",
        "rapi_jax/effects/_saturation.py",
        "part = jnp.where(crossed, ahead / jnp.where(crossed, rise, 1.0), part)",
        "part = jnp.where(crossed, 0.5, part)",
        "tests/rapi_jax/effects/test_drive_effects.py",
    ),
)
