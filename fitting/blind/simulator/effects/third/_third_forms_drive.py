"""Third forms of listed effects on the drive."""

import numpy as np

from fitting.blind.simulator._filters import lowpass
from fitting.blind.simulator._signal_path import Effect, RunState
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, drive_range, log_uniform

LAGS = 16  # of a resistive electrode; what is beyond them follows at once


def electrode_mean(u: Array, step: float, tau: float) -> Array:
    """Mean voltage along a resistive electrode fed at one end, `tanh(sqrt(s tau))/sqrt(s tau)`.

    In partial fractions: lags of `tau/(pi (k + 1/2))^2` with weights `2/(pi (k + 1/2))^2`.
    """
    weights = 2 / (np.pi * (np.arange(LAGS) + 0.5)) ** 2
    total = (1 - weights.sum()) * u
    for weight in weights.tolist():
        total += weight * lowpass(u, step, tau * weight / 2)
    return total


def amplifier_lowpass(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Charge that diffuses along the actuator's resistive electrode; strength: R C of it, s."""
    del rng, setting
    return Recipe(
        name="amplifier_lowpass", strength="tau", low=3e-6, high=3 / (2 * np.pi * 150),
        parameters={"form": "diffusive"},
        build=lambda tau: Effect(
            "amplifier_lowpass", drive=lambda u, now: electrode_mean(u, now.step, tau)
        ),
    )  # fmt: skip


def start_late(u: Array, now: RunState, latencies: Array) -> Array:
    """Each period is started by a trigger of its own, `latencies` s late, one per period in turn.

    The generator rests at a period's end until the next trigger, and is cut short by it.
    """
    period = 1 / now.scan.rate_hz
    place = now.t - now.scan.start_s + now.scan.phase * period
    number = np.floor(place / period).astype(int)
    begin = now.t - (place - number * period)
    count = number - number[0] + int(now.cycles) + 1
    late, before = (latencies[k % len(latencies)] for k in (count, count - 1))
    source = np.where(now.t - begin >= late, now.t - late, np.minimum(now.t - before, begin))
    return np.interp(source, now.t, u)


def delay(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A software trigger of each period, whose latency differs; strength: the mean latency, s."""
    del setting
    share = float(rng.uniform(0.3, 0.7))
    relative = 1 - share + share * np.minimum(rng.exponential(1.0, 4096), 5.0)
    return Recipe(
        name="delay", strength="tau", low=1e-6, high=1e-3,
        parameters={"form": "triggered", "share": share},
        build=lambda tau: Effect("delay", drive=lambda u, now: start_late(u, now, tau * relative)),
    )  # fmt: skip


def follow_two_limits(x: Array, step: float, rising: float, falling: float) -> Array:
    """`x` followed at no more than `rising` a second upwards and `falling` downwards."""
    up, down = rising * step, -falling * step
    y = float(x[0])
    out = []
    for target in x.tolist():
        y += min(max(target - y, down), up)
        out.append(y)
    return np.array(out)


def slew_limit(rng: np.random.Generator, setting: Setting) -> Recipe:
    """An output stage that sources and sinks unequal currents; strength: cut of the lower one."""
    ratio, steepest = log_uniform(rng, 1.1, 2.0), setting.steepest
    rising = bool(rng.random() < 0.5)

    def build(cut: float) -> Effect:
        least = (1 - cut) * steepest
        limits = (least, ratio * least) if rising else (ratio * least, least)
        return Effect("slew_limit", drive=lambda u, now: follow_two_limits(u, now.step, *limits))

    return Recipe(
        name="slew_limit", strength="cut", low=1e-5, high=0.6, build=build,
        parameters={"form": "unequal", "ratio": ratio, "steepest": steepest,
                    "lower": "rising" if rising else "falling"},
    )  # fmt: skip


def approach_rail(u: Array, step: float, rail: float, tau: float) -> Array:
    """`u` followed below `rail`, upwards at no more than `(rail - y)/tau` a second."""
    kept = float(np.exp(-step / tau))
    y = min(float(u[0]), rail)
    out = []
    for target in u.tolist():
        y = min(target, rail - kept * (rail - y))
        out.append(y)
    return np.array(out)


def saturation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A transistor in its ohmic region: near the rail the load is charged through a resistance.

    Strength: the cut at rest, of the drive's range.
    """
    (low, high), steepest = drive_range(setting.scans), setting.steepest
    share = float(rng.uniform(0.5, 2.0))

    def build(part: float) -> Effect:
        cut = part * (high - low)
        tau = share * cut / steepest
        return Effect(
            "saturation", drive=lambda u, now: approach_rail(u, now.step, high - cut, tau)
        )

    return Recipe(
        name="saturation", strength="part", low=1e-4, high=0.06, build=build,
        parameters={"form": "ohmic", "share": share, "steepest": steepest},
    )  # fmt: skip


BITS = 14


def quantisation(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A binary-weighted converter whose bits are mismatched; strength: the step in V.

    A bit is made of `2^i` elements, each off by `spread` of a step by itself.
    """
    del setting
    full, spread = float(rng.uniform(6.0, 10.0)), float(rng.uniform(0.05, 0.2))
    errors = spread * np.sqrt(2.0 ** np.arange(BITS)) * rng.standard_normal(BITS)

    def build(step: float) -> Effect:
        def drive(u: Array, now: RunState) -> Array:
            del now
            code = np.round(u / step)
            bits = (code.astype(np.int64)[:, None] >> np.arange(BITS)) & 1
            return step * (code + bits @ errors)

        return Effect("quantisation", drive=drive)

    return Recipe(
        name="quantisation", strength="step", low=full * 2.0**-14, high=full * 2.0**-6,
        build=build, parameters={"form": "binary", "spread": spread},
    )  # fmt: skip
