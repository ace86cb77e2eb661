"""Third unlisted effects of the actuator, its amplifier and the laser."""

import numpy as np

from fitting.blind.simulator._filters import derivative, lag
from fitting.blind.simulator._signal_path import Effect, RunState
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, drive_range, log_uniform


def accommodation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Each run's loops move to where they stay, period by period; strength: the first shift, GHz.

    As `exp(-n/n_0)` of the number `n` of periods driven in the run, at any rate, and as its swing.
    """
    reference, decay = setting.widest.swing, log_uniform(rng, 2.0, 8.0)
    sign = 1 if rng.random() < 0.5 else -1

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            driven = now.scan.rate_hz * (now.t - now.t[0])
            return nu + sign * x * now.scan.swing / reference * np.exp(-driven / decay)

        return Effect("unlisted:accommodation", displacement=displacement)

    return Recipe(
        name="unlisted:accommodation", strength="size", low=1e-3, high=30.0, build=build,
        parameters={"reference": reference, "decay": decay, "sign": sign},
    )  # fmt: skip


def quadratic_drag(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Drag as the square of the speed holds the mirror back; strength: at the fastest, GHz."""
    del rng
    fastest = max(
        float(np.max(np.abs(np.diff(nu)))) / scan.step_s
        for nu, scan in zip(setting.clean, setting.scans, strict=True)
    )

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            speed = derivative(nu, now.step) / fastest
            return nu - x * speed * np.abs(speed)

        return Effect("unlisted:quadratic_drag", displacement=displacement)

    return Recipe(
        name="unlisted:quadratic_drag", strength="size", low=1e-4, high=30.0, build=build,
        parameters={"fastest": fastest},
    )  # fmt: skip


def charge_leak(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A charge amplifier loses charge: `s/(s + x)` about the bias; strength: x in 1/s."""
    del rng, setting

    def build(x: float) -> Effect:
        def drive(u: Array, now: RunState) -> Array:
            return u - lag(u - now.scan.bias, now.step, 1 / x, (0.0, 0.0))

        return Effect("unlisted:charge_leak", drive=drive)

    return Recipe(
        name="unlisted:charge_leak", strength="leak", low=1e-4, high=20.0, build=build,
        parameters={},
    )  # fmt: skip


def hum_modulation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The amplifier's gain about the bias follows its rectified supply; strength: the modulation.

    Twice the line's frequency, with half as much of four times it.
    """
    del setting
    f, (p, q) = float(rng.choice([100.0, 120.0])), rng.uniform(0, 2 * np.pi, 2).tolist()

    def build(x: float) -> Effect:
        def drive(u: Array, now: RunState) -> Array:
            turn = 2 * np.pi * f * now.t
            wave = np.sin(turn + p) + 0.5 * np.sin(2 * turn + q)
            return now.scan.bias + (u - now.scan.bias) * (1 + x * wave)

        return Effect("unlisted:hum_modulation", drive=drive)

    return Recipe(
        name="unlisted:hum_modulation", strength="modulation", low=1e-6, high=0.1, build=build,
        parameters={"frequency": f, "phase": p, "phase_second": q},
    )  # fmt: skip


def converter_ripple(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A hysteretic converter's ripple, whose frequency follows the voltage; strength: in V."""
    low, high = drive_range(setting.scans)
    centre, bend = log_uniform(rng, 150.0, 500.0), float(rng.uniform(0.3, 0.7))
    bend *= float(rng.choice([-1, 1]))
    first = float(rng.uniform(0, 1))

    def build(x: float) -> Effect:
        def drive(u: Array, now: RunState) -> Array:
            frequency = centre * (1 + bend * (2 * (u - low) / (high - low) - 1))
            cycles = first + np.cumsum(frequency) * now.step
            return u + x * np.sin(2 * np.pi * cycles)

        return Effect("unlisted:converter_ripple", drive=drive)

    return Recipe(
        name="unlisted:converter_ripple", strength="ripple", low=1e-5, high=0.3, build=build,
        parameters={"centre": centre, "bend": bend, "first": first},
    )  # fmt: skip


def injection_locking(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Stray light of another laser locks this one near it, as Adler has it; strength: GHz.

    The mean frequency is off by `sign(d) sqrt(d^2 - L^2)` where `d` it would be, or not at all.
    """
    other = float(np.quantile(setting.pooled, rng.uniform(0.2, 0.8)))

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            del now
            off = nu - other
            return other + np.sign(off) * np.sqrt(np.maximum(off**2 - x**2, 0.0))

        return Effect("unlisted:injection_locking", light=light)

    return Recipe(
        name="unlisted:injection_locking", strength="range", low=1e-3, high=10.0, build=build,
        parameters={"other": other},
    )  # fmt: skip


def photothermal(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The laser's power follows its gain curve over the scan and warms the cavity, which lags.

    Strength: GHz at the gain's peak; power falls to none `width` away from it.
    """
    span = float(np.ptp(setting.pooled))
    peak = float(np.min(setting.pooled)) + span * float(rng.uniform(0.3, 0.7))
    width, tau = span * float(rng.uniform(0.8, 1.5)), log_uniform(rng, 3e-3, 0.1)

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            power = np.maximum(1 - ((np.append(nu, now.rest) - peak) / width) ** 2, 0.0)
            settled = float(power[-1])
            return nu + x * lag(power[:-1], now.step, tau, (settled, settled))

        return Effect("unlisted:photothermal", light=light)

    return Recipe(
        name="unlisted:photothermal", strength="size", low=1e-3, high=30.0, build=build,
        parameters={"peak": peak, "width": width, "tau": tau},
    )  # fmt: skip
