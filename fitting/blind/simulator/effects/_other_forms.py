"""Listed effects in other forms than the list's equations."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fitting.blind.simulator._filters import derivative, lowpass, rational_filter, second_order
from fitting.blind.simulator._signal_path import Effect, RunState, mean_at_crossings

from ._listed_optical import creep_of, hop_places, hop_states, pickup_frequency
from ._recipe import Array, Recipe, Setting, drive_range, log_uniform, path_in_time


def creep(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Logarithmic over eight decades of time, without the list's two ends."""
    del rng, setting
    return creep_of(np.geomspace(1e-4, 1e4, 33), {"form": "log"})


def resonance(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A mode with an antiresonance above it; strength: 1/f0."""
    del setting
    z, ratio = log_uniform(rng, 0.015, 0.1), float(rng.uniform(1.3, 2.0))

    def build(period: float) -> Effect:
        top, bottom = second_order(ratio / period, z), second_order(1 / period, z)
        return Effect(
            "resonance", displacement=lambda nu, now: rational_filter(nu, now.step, top, bottom)
        )

    return Recipe(
        name="resonance", strength="period", low=1 / 25e3, high=1 / 150.0, build=build,
        parameters={"form": "antiresonance", "damping": z, "ratio": ratio},
    )  # fmt: skip


def amplifier_lowpass(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Two equal lags, critically damped."""
    del rng, setting
    return Recipe(
        name="amplifier_lowpass", strength="tau", low=5e-7,
        high=1 / (4 * np.pi * 100), parameters={"form": "second order"},
        build=lambda tau: Effect(
            "amplifier_lowpass",
            drive=lambda u, now: lowpass(lowpass(u, now.step, tau), now.step, tau),
        ),
    )  # fmt: skip


def saturation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A soft knee at the upper end, as wide as the part cut off."""
    del rng
    low, high = drive_range(setting.scans)

    def build(part: float) -> Effect:
        cut = part * (high - low)
        knee = cut / 3
        return Effect(
            "saturation",
            drive=lambda u, now: u - knee * np.logaddexp(0, (u - (high - cut)) / knee),
        )

    return Recipe(
        name="saturation", strength="part", low=1e-4, high=0.06, build=build,
        parameters={"form": "soft"},
    )  # fmt: skip


def rate_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`zeta f/(1 + f/f_c)`, or a term in `f^2`; strength: `f_max/f_c`, or that term at `f_max`."""
    top = max(scan.rate_hz for scan in setting.scans)
    saturating = bool(rng.random() < 0.5)

    def rate(f: float, x: float) -> float:
        if saturating:
            return f * (1 + x / 2) / (1 + x * f / top)
        return f * (1 + x * (f / top - 0.5))

    return Recipe(
        name="rate_law", strength="bend", low=1e-3, high=4.0 if saturating else 1.9,
        parameters={"form": "saturating" if saturating else "square", "top": top},
        build=lambda x: Effect(
            "rate_law", law=lambda piezo: replace(piezo, rate_law=lambda f: rate(f, x))
        ),
    )  # fmt: skip


def amplitude_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain about rest falls with the square of the swing."""
    del rng
    reference = setting.widest.swing
    return Recipe(
        name="amplitude_law", strength="part", low=1e-4, high=0.3, parameters={"form": "square"},
        build=lambda x: Effect(
            "amplitude_law",
            displacement=lambda nu, now: (
                now.rest + (nu - now.rest) * (1 - x * ((now.scan.swing / reference) ** 2 - 1))
            ),
        ),
    )  # fmt: skip


def drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A random walk in the session's time; strength: its rms over the session."""
    horizon = 3 * setting.end_s + 100
    grid = np.linspace(0, horizon, 4000)
    walk = np.cumsum(rng.standard_normal(4000))
    walk /= np.std(walk[grid <= setting.end_s])
    path = path_in_time(horizon, grid, walk)
    return Recipe(
        name="drift", strength="size", low=1e-3, high=3.0, parameters={"form": "random walk"},
        build=lambda x: Effect("drift", light=lambda nu, now: nu + x * path(now.t)),
    )  # fmt: skip


def gain_drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain settles exponentially in the session's time."""
    tau = setting.end_s * log_uniform(rng, 0.2, 0.6)

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            centre = mean_at_crossings(now.operator_response, now.drive, now.scan.bias)
            return centre + (nu - centre) * (1 - x * np.exp(-now.t / tau))

        return Effect("gain_drift", light=light)

    return Recipe(
        name="gain_drift", strength="total", low=1e-5, high=0.03, build=build,
        parameters={"form": "exponential", "tau": tau},
    )  # fmt: skip


def mode_hop(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A hop that takes its time: that of the laser, some samples of the middle run."""
    up, down = hop_places(rng, setting)
    step = float(np.median([scan.step_s for scan in setting.scans]))
    settle_s = float(rng.uniform(1.0, 4.0)) * step
    return Recipe(
        name="mode_hop", strength="jump", low=0.2, high=4.0,
        parameters={"form": "smooth", "up": up, "down": down, "settle_s": settle_s},
        build=lambda jump: Effect(
            "mode_hop",
            light=lambda nu, now: (
                nu - jump * lowpass(hop_states(nu, up, down).astype(float), now.step, settle_s)
            ),
        ),
    )  # fmt: skip


def etalon(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Airy fringes: narrow peaks instead of a sine."""
    spacing = log_uniform(rng, 2.0, max(4.0, 0.4 * float(np.ptp(setting.pooled))))
    p, sharp = float(rng.uniform(0, np.pi)), log_uniform(rng, 2.0, 20.0)
    return Recipe(
        name="etalon", strength="amplitude", low=1e-3, high=1.0,
        parameters={"form": "Airy", "spacing": spacing, "phase": p, "finesse": sharp},
        build=lambda x: Effect(
            "etalon",
            light=lambda nu, now: nu + x / (1 + sharp * np.sin(np.pi * nu / spacing + p) ** 2),
        ),
    )  # fmt: skip


def pickup(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A line frequency with its third harmonic."""
    del setting
    f, p, q = pickup_frequency(rng), *rng.uniform(0, 2 * np.pi, 2).tolist()

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            turn = 2 * np.pi * f * now.t
            return nu + x * (np.sin(turn + p) + 0.4 * np.sin(3 * turn + q))

        return Effect("pickup", light=light)

    return Recipe(
        name="pickup", strength="amplitude", low=1e-4, high=1.0, build=build,
        parameters={"form": "two harmonics", "frequency": f, "phase": p, "phase_third": q},
    )  # fmt: skip


def current_coupling(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`k du/dt` through a lag of 0.05 to 0.3 ms."""
    del setting
    tau = log_uniform(rng, 5e-5, 3e-4)
    return Recipe(
        name="current_coupling", strength="k", low=1e-7, high=1e-2,
        parameters={"form": "lagged", "tau": tau},
        build=lambda k: Effect(
            "current_coupling",
            light=lambda nu, now: nu + k * lowpass(derivative(now.drive, now.step), now.step, tau),
        ),
    )  # fmt: skip


FORMS: dict[str, Callable[[np.random.Generator, Setting], Recipe]] = {
    maker.__name__: maker
    for maker in (
        amplifier_lowpass, amplitude_law, creep, current_coupling, drift, etalon, gain_drift,
        mode_hop, pickup, rate_law, resonance, saturation,
    )
}  # fmt: skip
