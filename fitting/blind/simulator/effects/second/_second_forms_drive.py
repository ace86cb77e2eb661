"""Second forms of listed effects on the drive and on the actuator's laws."""

from dataclasses import replace

import numpy as np

from fitting.blind.simulator._filters import delay_signal
from fitting.blind.simulator._piezo import Piezo
from fitting.blind.simulator._signal_path import Effect, RunState
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, drive_range, log_uniform


def unequal_lags(x: Array, step: float, rising: float, falling: float) -> Array:
    """First-order lag, its time constant `rising` below the input and `falling` above it."""

    def coefficients(tau: float) -> tuple[float, float, float]:
        m = step / tau
        kept = float(np.exp(-m))
        fresh = 1 + float(np.expm1(-m)) / m
        return kept, fresh, 1 - kept - fresh

    up, down = coefficients(rising), coefficients(falling)
    y = before = float(x[0])
    out = []
    for now in x.tolist():
        kept, fresh, late = up if now > y else down
        y = kept * y + fresh * now + late * before
        before = now
        out.append(y)
    return np.array(out)


def amplifier_lowpass(rng: np.random.Generator, setting: Setting) -> Recipe:
    """An output stage that charges its load faster, or slower, than it discharges it."""
    del setting
    ratio = log_uniform(rng, 1.6, 3.5) ** float(rng.choice([-1, 1]))
    return Recipe(
        name="amplifier_lowpass", strength="tau", low=1e-6, high=1 / (2 * np.pi * 150),
        parameters={"form": "unequal", "ratio": ratio},
        build=lambda tau: Effect(
            "amplifier_lowpass",
            drive=lambda u, now: unequal_lags(u, now.step, tau, ratio * tau),
        ),
    )  # fmt: skip


def delay(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A latency that settles in the session's time; strength: what it settles to, s."""
    start = float(rng.uniform(0.6, 1.5))
    tau = setting.end_s * log_uniform(rng, 0.2, 1.0)
    return Recipe(
        name="delay", strength="tau", low=5e-7, high=1e-3,
        parameters={"form": "settling", "start": start, "settling_s": tau},
        build=lambda x: Effect(
            "delay",
            drive=lambda u, now: delay_signal(u, now.step, x * (1 + start * np.exp(-now.t / tau))),
        ),
    )  # fmt: skip


def bounded_slope(
    x: Array, step: float, limit: float, bend: float, ends: tuple[float, float]
) -> Array:
    """`x` followed at no more than `limit (1 + bend (1 - h))` a second, h its height in `ends`."""
    low, high = ends
    y = float(x[0])
    out = []
    for target in x.tolist():
        most = limit * step * (1 + bend * (high - y) / (high - low))
        y += min(max(target - y, -most), most)
        out.append(y)
    return np.array(out)


def slew_limit(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A current limit into a capacitance that grows with the voltage: least slope at the top."""
    bend, ends, steepest = (
        float(rng.uniform(0.1, 0.4)),
        drive_range(setting.scans),
        setting.steepest,
    )
    return Recipe(
        name="slew_limit", strength="cut", low=1e-5, high=0.6,
        parameters={"form": "by height", "bend": bend, "steepest": steepest},
        build=lambda cut: Effect(
            "slew_limit",
            drive=lambda u, now: bounded_slope(u, now.step, (1 - cut) * steepest, bend, ends),
        ),
    )  # fmt: skip


def saturation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A rail that carries its rectifier's ripple; strength: its mean cut, of the drive's range."""
    low, high = drive_range(setting.scans)
    f, p = float(rng.choice([100.0, 120.0])), float(rng.uniform(0, 2 * np.pi))
    share = float(rng.uniform(0.2, 0.6))

    def build(part: float) -> Effect:
        cut = part * (high - low)

        def drive(u: Array, now: RunState) -> Array:
            return np.minimum(u, high - cut * (1 + share * np.sin(2 * np.pi * f * now.t + p)))

        return Effect("saturation", drive=drive)

    return Recipe(
        name="saturation", strength="part", low=1e-4, high=0.06, build=build,
        parameters={"form": "rippled", "frequency": f, "phase": p, "share": share},
    )  # fmt: skip


CODES = 2**14


def quantisation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A converter whose levels are each off by a part of a step; strength: the step in V."""
    del setting
    full, spread = float(rng.uniform(6.0, 10.0)), float(rng.uniform(0.15, 0.35))
    errors = spread * rng.standard_normal(CODES)

    def build(step: float) -> Effect:
        def drive(u: Array, now: RunState) -> Array:
            del now
            code = np.round(u / step)
            return step * (code + errors[code.astype(int) % CODES])

        return Effect("quantisation", drive=drive)

    return Recipe(
        name="quantisation", strength="step", low=full * 2.0**-14, high=full * 2.0**-6,
        build=build, parameters={"form": "uneven", "spread": spread},
    )  # fmt: skip


def rate_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`zeta f` with a Debye peak on it; strength: its height over `zeta` times its rate."""
    rates = [scan.rate_hz for scan in setting.scans]
    peak = log_uniform(rng, 1.2 * min(rates), 0.8 * max(rates))

    def build(x: float) -> Effect:
        def law(piezo: Piezo) -> Piezo:
            def rate(f: float) -> float:
                return piezo.rate_law(f) + x * peak * 2 * (f / peak) / (1 + (f / peak) ** 2)

            return replace(piezo, rate_law=rate)

        return Effect("rate_law", law=law)

    return Recipe(
        name="rate_law", strength="height", low=1e-3, high=2.5, build=build,
        parameters={"form": "peak", "peak": peak},
    )  # fmt: skip


def amplitude_law(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The loop's opening, not its gain, grows with the swing as Rayleigh's law has it, or falls."""
    reference = setting.widest.swing
    sign = 1 if rng.random() < 0.5 else -1
    return Recipe(
        name="amplitude_law", strength="part", low=1e-4, high=0.9,
        parameters={"form": "opening", "reference": reference, "sign": sign},
        build=lambda x: Effect(
            "amplitude_law",
            displacement=lambda nu, now: (
                nu + sign * x * (now.scan.swing / reference - 1) * now.hysteresis_part
            ),
        ),
    )  # fmt: skip
