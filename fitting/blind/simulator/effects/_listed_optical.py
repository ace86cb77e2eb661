"""Listed effects on the displacement and on the light, written from their equations."""

from typing import Any

import numpy as np
import numpy.typing as npt

from fitting.blind.simulator._filters import derivative, lag, rational_filter, second_order
from fitting.blind.simulator._signal_path import Effect, RunState, mean_at_crossings

from ._recipe import Array, Recipe, Setting, log_uniform


def creep_response(x: Array, now: RunState, taus: Array, weights: Array) -> Array:
    """`sum_k w_k L_k[x]`; the lags decay while the displacement rests between runs."""
    held = now.state.get("creep")
    total = np.zeros_like(x)
    fresh = []
    for k, (tau, weight) in enumerate(zip(taus.tolist(), weights.tolist(), strict=True)):
        before = held[1][k] * float(np.exp(-max(now.t[0] - held[0], 0.0) / tau)) if held else 0.0
        y = lag(x, now.step, tau, (0.0, before))
        total += weight * y
        fresh.append(float(y[-1]))
    now.state["creep"] = (float(now.t[-1]), fresh)
    return total


def creep(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A step answers as `g log10 t` from 5 ms to 20 s: twelve lags, equal weights a decade."""
    del rng, setting
    return creep_of(np.geomspace(5e-3, 20.0, 12), {})


def creep_of(taus: Array, parameters: dict[str, Any]) -> Recipe:
    """Creep by lags that are even in the logarithm of time, with equal weights a decade."""
    weights = np.full(taus.size, np.log10(taus[1] / taus[0]))
    return Recipe(
        name="creep", strength="gain", low=5e-4, high=0.05, parameters=parameters,
        build=lambda g: Effect(
            "creep",
            displacement=lambda nu, now: nu + g * creep_response(nu - now.rest, now, taus, weights),
        ),
    )  # fmt: skip


def resonance(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`w0^2/(s^2 + 2 z w0 s + w0^2)`; strength: 1/f0, from 25 kHz down to 150 Hz."""
    del setting
    z = log_uniform(rng, 0.015, 0.15)
    return Recipe(
        name="resonance", strength="period", low=1 / 25e3, high=1 / 150.0,
        parameters={"damping": z},
        build=lambda period: Effect(
            "resonance",
            displacement=lambda nu, now: rational_filter(
                nu, now.step, [1.0], second_order(1 / period, z)
            ),
        ),
    )  # fmt: skip


def drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Slow exponential in the session's time; strength: its end value, 1 MHz to 3 GHz."""
    tau = setting.end_s * log_uniform(rng, 0.15, 2.0)
    sign = 1 if rng.random() < 0.5 else -1
    return Recipe(
        name="drift", strength="size", low=1e-3, high=3.0, parameters={"tau": tau, "sign": sign},
        build=lambda x: Effect(
            "drift", light=lambda nu, now: nu + sign * x * -np.expm1(-now.t / tau)
        ),
    )  # fmt: skip


def gain_drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`1 + k t` about the response at the drive's centre; strength: `k` times the session."""
    sign = 1 if rng.random() < 0.5 else -1
    end = setting.end_s

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            centre = mean_at_crossings(now.operator_response, now.drive, now.scan.bias)
            return centre + (nu - centre) * (1 + sign * x * now.t / end)

        return Effect("gain_drift", light=light)

    return Recipe(
        name="gain_drift", strength="total", low=1e-5, high=0.03, build=build,
        parameters={"sign": sign, "session": end},
    )  # fmt: skip


def hop_states(nu: Array, up: float, down: float) -> npt.NDArray[np.bool_]:
    """Whether the laser has hopped: set above `up`, reset below `down`, kept between, first not."""
    mark = np.where(nu > up, 1, np.where(nu < down, 0, -1))
    known = np.maximum.accumulate(np.where(mark >= 0, np.arange(len(nu)), -1))
    return (known >= 0) & (mark[np.maximum(known, 0)] == 1)


def hop_places(rng: np.random.Generator, setting: Setting) -> tuple[float, float]:
    """Thresholds up and down in GHz at which a drawn jump has about the size asked for."""
    jump = log_uniform(rng, 0.4, 3.0)
    part = float(np.clip(2.5 * (setting.target / jump) ** 2, 1e-4, 0.5))
    up = float(np.quantile(setting.pooled, 1 - part))
    return up, up - float(rng.uniform(0.05, 0.5))


def mode_hop(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A jump at a threshold in frequency, itself hysteretic; strength: the jump, 0.2 to 4 GHz."""
    up, down = hop_places(rng, setting)
    sign = 1 if rng.random() < 0.5 else -1
    return Recipe(
        name="mode_hop", strength="jump", low=0.2, high=4.0,
        parameters={"up": up, "down": down, "sign": sign},
        build=lambda jump: Effect(
            "mode_hop", light=lambda nu, now: nu + sign * jump * hop_states(nu, up, down)
        ),
    )  # fmt: skip


def etalon(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`A sin(2 pi nu/F + p)`, F from 1 GHz to the span."""
    spacing = log_uniform(rng, 1.0, max(2.0, 0.5 * float(np.ptp(setting.pooled))))
    p = float(rng.uniform(0, 2 * np.pi))
    return Recipe(
        name="etalon", strength="amplitude", low=1e-3, high=0.5,
        parameters={"spacing": spacing, "phase": p},
        build=lambda x: Effect(
            "etalon", light=lambda nu, now: nu + x * np.sin(2 * np.pi * nu / spacing + p)
        ),
    )  # fmt: skip


def pickup_frequency(rng: np.random.Generator) -> float:
    """A line harmonic or an acoustic frequency, Hz."""
    if rng.random() < 0.6:
        return float(rng.choice([50.0, 60.0])) * float(rng.choice([1, 2, 3]))
    return log_uniform(rng, 30.0, 900.0)


def pickup(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`A sin(2 pi f t + p)` in the session's time."""
    del setting
    f, p = pickup_frequency(rng), float(rng.uniform(0, 2 * np.pi))
    return Recipe(
        name="pickup", strength="amplitude", low=1e-4, high=1.0,
        parameters={"frequency": f, "phase": p},
        build=lambda x: Effect(
            "pickup", light=lambda nu, now: nu + x * np.sin(2 * np.pi * f * now.t + p)
        ),
    )  # fmt: skip


def current_coupling(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`k du/dt` added; strength: k in GHz s/V."""
    del setting
    sign = 1 if rng.random() < 0.5 else -1
    return Recipe(
        name="current_coupling", strength="k", low=1e-7, high=1e-2, parameters={"sign": sign},
        build=lambda k: Effect(
            "current_coupling",
            light=lambda nu, now: nu + sign * k * derivative(now.drive, now.step),
        ),
    )  # fmt: skip
