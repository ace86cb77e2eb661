"""Listed effects on the drive and on the actuator's laws, written from their equations."""

from dataclasses import replace

import numpy as np

from fitting.blind.simulator._filters import delay_signal, limit_slope, lowpass
from fitting.blind.simulator._signal_path import Effect

from ._recipe import Recipe, Setting, drive_range


def amplifier_lowpass(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`1/(tau s + 1)`, corner at 150 Hz to 6 kHz, or higher where that is too much."""
    del rng, setting
    return Recipe(
        name="amplifier_lowpass", strength="tau", low=1e-6,
        high=1 / (2 * np.pi * 150), parameters={},
        build=lambda tau: Effect(
            "amplifier_lowpass", drive=lambda u, now: lowpass(u, now.step, tau)
        ),
    )  # fmt: skip


def delay(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`u(t - tau)`, 1 us to 1 ms."""
    del rng, setting
    return Recipe(
        name="delay", strength="tau", low=1e-6, high=1e-3, parameters={},
        build=lambda tau: Effect("delay", drive=lambda u, now: delay_signal(u, now.step, tau)),
    )  # fmt: skip


def slew_limit(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`|du/dt|` limited, to a part of the session's steepest slope; strength: the part cut off."""
    del rng
    steepest = setting.steepest

    def build(cut: float) -> Effect:
        limit = (1 - cut) * steepest
        return Effect("slew_limit", drive=lambda u, now: limit_slope(u, now.step, limit))

    return Recipe(
        name="slew_limit", strength="cut", low=1e-5, high=0.6, build=build,
        parameters={"steepest": steepest},
    )  # fmt: skip


def saturation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Clipped at one end; strength: the clipped part of the session's drive range."""
    low, high = drive_range(setting.scans)
    top = bool(rng.random() < 0.5)

    def build(part: float) -> Effect:
        cut = part * (high - low)
        if top:
            return Effect("saturation", drive=lambda u, now: np.minimum(u, high - cut))
        return Effect("saturation", drive=lambda u, now: np.maximum(u, low + cut))

    return Recipe(
        name="saturation", strength="part", low=1e-4, high=0.06, build=build,
        parameters={"end": "high" if top else "low"},
    )  # fmt: skip


def quantisation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Rounded to `2^-n` of a range and held; strength: the step in V, for 6 to 14 bit."""
    del setting
    full = float(rng.uniform(6.0, 10.0))
    offset = float(rng.uniform(0, 1))

    def build(step: float) -> Effect:
        return Effect(
            "quantisation", drive=lambda u, now: step * (np.round(u / step - offset) + offset)
        )

    return Recipe(
        name="quantisation", strength="step", low=full * 2.0**-14, high=full * 2.0**-6,
        build=build, parameters={"offset": offset},
    )  # fmt: skip


def rate_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`zeta f^m` instead of `zeta f`, equal at one rate; strength: how far m lies from 1."""
    reference = float(np.median([scan.rate_hz for scan in setting.scans]))
    up = bool(rng.random() < 0.5)

    def build(far: float) -> Effect:
        m = 1 + far if up else 1 - far
        return Effect(
            "rate_law",
            law=lambda piezo: replace(piezo, rate_law=lambda f: reference * (f / reference) ** m),
        )

    return Recipe(
        name="rate_law", strength="far", low=1e-3, high=1.6 if up else 0.8, build=build,
        parameters={"reference": reference, "sign": 1 if up else -1},
    )  # fmt: skip


def amplitude_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain about rest, or the threshold a half swing, as a power of the swing."""
    reference = setting.widest.swing
    sign = 1 if rng.random() < 0.5 else -1
    gain = bool(rng.random() < 0.5)

    def build(x: float) -> Effect:
        if gain:
            return Effect(
                "amplitude_law",
                displacement=lambda nu, now: (
                    now.rest + (nu - now.rest) * (now.scan.swing / reference) ** (sign * x)
                ),
            )
        return Effect(
            "amplitude_law",
            law=lambda piezo: replace(
                piezo, swing_law=lambda swing: (swing / reference) ** (sign * x)
            ),
        )

    return Recipe(
        name="amplitude_law", strength="exponent", low=1e-4, high=0.4, build=build,
        parameters={"reference": reference, "sign": sign, "on": "gain" if gain else "threshold"},
    )  # fmt: skip
