"""Third forms of listed effects on the actuator's laws and on the displacement."""

from dataclasses import replace

import numpy as np
from scipy import special

from fitting.blind.simulator._filters import rational_filter, second_order
from fitting.blind.simulator._piezo import Piezo
from fitting.blind.simulator._signal_path import Effect, RunState
from fitting.blind.simulator.effects._listed_optical import creep_response
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, log_uniform

LAGS = np.geomspace(1e-4, 1e6, 41)  # s, of a power law's creep


def rate_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Thermally activated domain walls beside viscous ones: `f` and a logarithm of it.

    `zeta (f + x f_r log(1 + f/f_0)/log(1 + f_r/f_0))`; strength: x, their parts' ratio at `f_r`.
    """
    reference = float(np.median([scan.rate_hz for scan in setting.scans]))
    attempt = log_uniform(rng, 0.3, 3.0)

    def build(x: float) -> Effect:
        def law(piezo: Piezo) -> Piezo:
            def rate(f: float) -> float:
                activated = np.log1p(f / attempt) / np.log1p(reference / attempt)
                return piezo.rate_law(f) + x * reference * float(activated)

            return replace(piezo, rate_law=rate)

        return Effect("rate_law", law=law)

    return Recipe(
        name="rate_law", strength="ratio", low=1e-3, high=6.0, build=build,
        parameters={"form": "logarithm", "reference": reference, "attempt": attempt},
    )  # fmt: skip


def amplitude_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain about rest is constant below a threshold swing, and grows linearly beyond it."""
    reference = setting.widest.swing
    threshold = reference * float(rng.uniform(0.4, 0.85))
    return Recipe(
        name="amplitude_law", strength="part", low=1e-4, high=0.3,
        parameters={"form": "threshold", "threshold": threshold, "reference": reference},
        build=lambda x: Effect(
            "amplitude_law",
            displacement=lambda nu, now: (
                now.rest + (nu - now.rest)
                * (1 + x * (max(now.scan.swing - threshold, 0.0) / (reference - threshold) - 1))
            ),
        ),
    )  # fmt: skip


def power_law_weights(exponent: float) -> Array:
    """Weights of `LAGS` that answer a step as `t^exponent`, t in s, from its relaxation spectrum.

    But for a constant: what follows faster than the least lag is elastic, and part of the gain.
    """
    apart = np.log(LAGS[1] / LAGS[0])
    return apart * LAGS**exponent * exponent / special.gamma(1 - exponent)


def creep(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Andrade's creep, a power of time; strength: its part of the displacement after 1 s."""
    del setting
    exponent = float(rng.uniform(0.15, 0.4))
    weights = power_law_weights(exponent)
    return Recipe(
        name="creep", strength="gain", low=5e-4, high=0.2,
        parameters={"form": "power", "exponent": exponent},
        build=lambda g: Effect(
            "creep",
            displacement=lambda nu, now: nu + g * creep_response(nu - now.rest, now, LAGS, weights),
        ),
    )  # fmt: skip


def resonance(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Two modes side by side, the upper one in phase or in antiphase; strength: 1/f0."""
    del setting
    z, ratio = log_uniform(rng, 0.015, 0.1), float(rng.uniform(1.5, 3.0))
    share = float(rng.uniform(0.15, 0.4)) * float(rng.choice([-1, 1]))

    def build(period: float) -> Effect:
        lower, upper = second_order(1 / period, z), second_order(ratio / period, z)

        def displacement(nu: Array, now: RunState) -> Array:
            return (1 - share) * rational_filter(nu, now.step, [1.0], lower) + (
                share * rational_filter(nu, now.step, [1.0], upper)
            )

        return Effect("resonance", displacement=displacement)

    return Recipe(
        name="resonance", strength="period", low=1 / 25e3, high=1 / 150.0, build=build,
        parameters={"form": "two modes", "damping": z, "ratio": ratio, "share": share},
    )  # fmt: skip
