"""Effects that no list holds: whose correct verdict is `unlisted`."""

from collections.abc import Callable

import numpy as np
from scipy import signal

from fitting.blind.simulator._filters import (
    delay_signal,
    derivative,
    lowpass,
    rational_filter,
    second_order,
)
from fitting.blind.simulator._plays import stretch_index, turning_points
from fitting.blind.simulator._signal_path import Effect, RunState

from ._recipe import Array, Recipe, Setting, drive_range, log_uniform, path_in_time


def stick_slip(u: Array, width: float) -> Array:
    """Sticks where the drive turns, until it is `width` away, then slips to it at once."""
    ends = turning_points(u)
    begins = np.concatenate(([u[0]], u[ends[:-1]]))[stretch_index(ends, len(u))]
    return np.where(np.abs(u - begins) > width, u, begins)


def stiction(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Friction that holds the drive after each turn and lets go with a jump."""
    del rng, setting
    return Recipe(
        name="unlisted:stiction", strength="width", low=1e-4, high=0.5, parameters={},
        build=lambda w: Effect("unlisted:stiction", drive=lambda u, now: stick_slip(u, w)),
    )  # fmt: skip


def absorption(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Pulling by an absorption line: a dispersive curve about one frequency; strength: its peak."""
    line = float(np.quantile(setting.pooled, rng.uniform(0.2, 0.8)))
    half = log_uniform(rng, 0.3, 2.0)

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            del now
            far = (nu - line) / half
            return nu - x * 2 * far / (1 + far**2)

        return Effect("unlisted:absorption", light=light)

    return Recipe(
        name="unlisted:absorption", strength="pull", low=1e-3, high=1.0, build=build,
        parameters={"line": line, "half_width": half},
    )  # fmt: skip


def telegraph(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Jumps between two frequencies at random times."""
    mean = log_uniform(rng, 0.01, 0.15)  # s between jumps
    horizon = 3 * setting.end_s + 100
    jumps = np.cumsum(rng.exponential(mean, int(1.2 * horizon / mean) + 50))
    first = int(rng.integers(2))

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            return nu + x * ((np.searchsorted(jumps, now.t) + first) % 2 - 0.5)

        return Effect("unlisted:telegraph", light=light)

    return Recipe(
        name="unlisted:telegraph", strength="jump", low=1e-3, high=3.0, build=build,
        parameters={"mean_s": mean, "first": first},
    )  # fmt: skip


def fatigue(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The loop opens with every period driven; strength: its growth over the session."""
    del rng
    total = sum(scan.periods for scan in setting.scans)

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            driven = now.cycles + (now.t - now.t[0]) * now.scan.rate_hz
            return nu + x * driven / total * now.hysteresis_part

        return Effect("unlisted:fatigue", displacement=displacement)

    return Recipe(
        name="unlisted:fatigue", strength="growth", low=1e-5, high=1.0, build=build,
        parameters={"periods": total},
    )  # fmt: skip


def drive_delay(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A delay that grows with the square of the drive's height; strength: at the highest, s."""
    low, high = drive_range(setting.scans)
    down = bool(rng.random() < 0.5)

    def build(x: float) -> Effect:
        def drive(u: Array, now: RunState) -> Array:
            height = np.clip((u - low) / (high - low), 0.0, 1.0)
            return delay_signal(u, now.step, x * (1 - height if down else height) ** 2)

        return Effect("unlisted:drive_delay", drive=drive)

    return Recipe(
        name="unlisted:drive_delay", strength="tau", low=1e-6, high=3e-3, build=build,
        parameters={"longest_at": "low" if down else "high"},
    )  # fmt: skip


def crossover(rng: np.random.Generator, setting: Setting) -> Recipe:
    """An amplifier whose halves do not meet: a dead step about one voltage; strength: in V."""
    del setting
    zero, width = float(rng.uniform(2.5, 3.5)), log_uniform(rng, 0.02, 0.15)
    return Recipe(
        name="unlisted:crossover", strength="step", low=1e-4, high=width,
        parameters={"zero": zero, "width": width},
        build=lambda x: Effect(
            "unlisted:crossover",
            drive=lambda u, now: u - x * np.tanh((u - zero) / width),
        ),
    )  # fmt: skip


def ripple(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A temperature controller's ripple: narrow-band noise about 0.5 to 4 Hz, locked to nothing."""
    centre, quality = log_uniform(rng, 0.5, 4.0), float(rng.uniform(1.0, 3.0))
    horizon = 3 * setting.end_s + 100
    step = 1 / (40 * centre)
    grid = np.arange(0, horizon, step)
    b, a = signal.iirpeak(centre, quality, fs=1 / step)
    wave = np.asarray(signal.lfilter(b, a, rng.standard_normal(len(grid))))
    path = path_in_time(horizon, grid, wave / np.std(wave))
    return Recipe(
        name="unlisted:ripple", strength="size", low=1e-3, high=3.0,
        parameters={"centre": centre, "quality": quality},
        build=lambda x: Effect("unlisted:ripple", light=lambda nu, now: nu + x * path(now.t)),
    )  # fmt: skip


def notch(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A broad partial notch in the amplifier; strength: its depth."""
    del setting
    centre, z = log_uniform(rng, 60.0, 600.0), float(rng.uniform(0.2, 0.6))
    return Recipe(
        name="unlisted:notch", strength="depth", low=1e-3, high=0.9,
        parameters={"centre": centre, "damping": z},
        build=lambda x: Effect(
            "unlisted:notch",
            drive=lambda u, now: rational_filter(
                u, now.step, second_order(centre, z * (1 - x)), second_order(centre, z)
            ),
        ),
    )  # fmt: skip


def earlier_maximum(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain remembers how far the run before went, and forgets it; strength: a part of it."""
    tau = log_uniform(rng, 0.1, 1.0)
    low, high = drive_range(setting.scans)

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            before, here = now.earlier, now.scan
            if before is None:
                return nu
            more = before.bias + before.swing / 2 - here.bias - here.swing / 2
            fading = np.exp(-(now.t - now.t[0]) / tau)
            return nu + x * more / (high - low) * fading * (nu - now.rest)

        return Effect("unlisted:earlier_maximum", displacement=displacement)

    return Recipe(
        name="unlisted:earlier_maximum", strength="part", low=1e-5, high=0.5, build=build,
        parameters={"tau": tau},
    )  # fmt: skip


def self_heating(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Dielectric loss warms the actuator, as the drive's slope squared, and it cools slowly."""
    tau = log_uniform(rng, 0.3, 3.0)
    steepest = setting.steepest

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            power = (derivative(now.drive, now.step) / steepest) ** 2
            power[0] = 0.0  # cold before the lead-in
            return nu + x * lowpass(power, now.step, tau)

        return Effect("unlisted:self_heating", displacement=displacement)

    return Recipe(
        name="unlisted:self_heating", strength="size", low=1e-4, high=30.0, build=build,
        parameters={"tau": tau},
    )  # fmt: skip


UNLISTED: dict[str, Callable[[np.random.Generator, Setting], Recipe]] = {
    maker.__name__: maker
    for maker in (
        absorption, crossover, drive_delay, earlier_maximum, fatigue, notch, ripple, self_heating,
        stiction, telegraph,
    )
}  # fmt: skip
