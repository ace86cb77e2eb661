"""Third forms of listed effects on the light."""

import numpy as np

from fitting.blind.simulator._filters import derivative
from fitting.blind.simulator._signal_path import Effect, RunState, mean_at_crossings
from fitting.blind.simulator.effects._listed_optical import hop_places, hop_states
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, log_uniform


def drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A room whose heating is switched on and off by a thermostat; strength: peak to peak, GHz."""
    cycle = setting.end_s * log_uniform(rng, 0.25, 1.0)
    on, tau = cycle * float(rng.uniform(0.3, 0.7)), cycle * log_uniform(rng, 0.2, 1.5)
    begin = float(rng.uniform(0, cycle))
    warmest = np.expm1(-on / tau) / np.expm1(-cycle / tau)
    coldest = warmest * np.exp(-(cycle - on) / tau)

    def warmth(t: Array) -> Array:
        since = np.mod(t - begin, cycle)
        warming = 1 - (1 - coldest) * np.exp(-since / tau)
        cooling = warmest * np.exp(-(since - on) / tau)
        return (np.where(since < on, warming, cooling) - coldest) / (warmest - coldest)

    return Recipe(
        name="drift", strength="size", low=1e-3, high=3.0,
        parameters={"form": "thermostat", "cycle_s": cycle, "on_s": on, "tau": tau, "begin": begin},
        build=lambda x: Effect("drift", light=lambda nu, now: nu + x * warmth(now.t)),
    )  # fmt: skip


def heat_by_losses(now: RunState, tau: float, hardest: float) -> Array:
    """Temperature that losses raise in each run and that falls between them, on the fine clock.

    Losses as the rate and the square of the swing; 1 is where the run of `hardest` losses would
    settle. The lag is `tau` s.
    """
    ended, warm = now.state.get("warmth", (float(now.t[0]), 0.0))
    warm *= float(np.exp(-(now.t[0] - ended) / tau))
    loss = now.scan.rate_hz * now.scan.swing**2 / hardest
    warmth = loss + (warm - loss) * np.exp(-(now.t - now.t[0]) / tau)
    now.state["warmth"] = (float(now.t[-1]), float(warmth[-1]))
    return warmth


def gain_drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain follows the actuator's temperature; strength: after a second of the hardest run."""
    tau = setting.end_s * log_uniform(rng, 0.1, 0.5)
    sign = 1 if rng.random() < 0.5 else -1
    hardest = max(scan.rate_hz * scan.swing**2 for scan in setting.scans)
    second = -float(np.expm1(-1 / tau))

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            warmth = heat_by_losses(now, tau, hardest) / second
            centre = mean_at_crossings(now.operator_response, now.drive, now.scan.bias)
            return centre + (nu - centre) * (1 + sign * x * warmth)

        return Effect("gain_drift", light=light)

    return Recipe(
        name="gain_drift", strength="gain", low=1e-5, high=0.1, build=build,
        parameters={"form": "losses", "tau": tau, "sign": sign, "hardest": hardest},
    )  # fmt: skip


def mode_hop(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Thermally activated: the place of the hop differs from period to period."""
    up, down = hop_places(rng, setting)
    sign = 1 if rng.random() < 0.5 else -1
    spread = log_uniform(rng, 0.05, 0.4)  # GHz
    shifts = spread * rng.standard_normal(4096)

    def build(jump: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            period = now.scan.rate_hz * (now.t - now.scan.start_s) + now.scan.phase
            number = (np.floor(period) - np.floor(period[0]) + now.cycles).astype(int)
            shifted = nu - shifts[number % len(shifts)]
            return nu + sign * jump * hop_states(shifted, up, down)

        return Effect("mode_hop", light=light)

    return Recipe(
        name="mode_hop", strength="jump", low=0.2, high=4.0, build=build,
        parameters={"form": "activated", "up": up, "down": down, "spread": spread, "sign": sign},
    )  # fmt: skip


def etalon(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A window that warms up after the session's beginning: its fringes move."""
    spacing = log_uniform(rng, 1.5, max(3.0, 0.4 * float(np.ptp(setting.pooled))))
    p, turn = float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(1.0, 4.0)) * rng.choice([-1, 1])
    tau = setting.end_s * log_uniform(rng, 0.3, 1.0)

    def fringes(nu: Array, t: Array) -> Array:
        return np.sin(2 * np.pi * nu / spacing + p - turn * np.expm1(-t / tau))

    return Recipe(
        name="etalon", strength="amplitude", low=1e-3, high=0.5,
        parameters={"form": "warming", "spacing": spacing, "phase": p, "turn": float(turn),
                    "warming_s": tau},
        build=lambda x: Effect("etalon", light=lambda nu, now: nu + x * fringes(nu, now.t)),
    )  # fmt: skip


def pickup(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Two induction motors of unequal slip: their hum beats; strength: the stronger one's, GHz."""
    del setting
    speed, share = float(rng.choice([25.0, 30.0, 50.0, 60.0])), float(rng.uniform(0.5, 0.9))
    f, g = speed * (1 - rng.uniform([0.01, 0.035], [0.03, 0.07]))
    p, q = rng.uniform(0, 2 * np.pi, 2).tolist()

    def hum(t: Array) -> Array:
        return np.sin(2 * np.pi * f * t + p) + share * np.sin(2 * np.pi * g * t + q)

    return Recipe(
        name="pickup", strength="amplitude", low=1e-4, high=1.0,
        parameters={"form": "beating", "frequency": float(f), "frequency_second": float(g),
                    "share": share, "phase": p, "phase_second": q},
        build=lambda x: Effect("pickup", light=lambda nu, now: nu + x * hum(now.t)),
    )  # fmt: skip


def current_coupling(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Only while it charges does the amplifier load the supply that the laser's diode shares."""
    del setting
    sign = 1 if rng.random() < 0.5 else -1
    return Recipe(
        name="current_coupling", strength="k", low=1e-7, high=1e-2,
        parameters={"form": "charging", "sign": sign},
        build=lambda k: Effect(
            "current_coupling",
            light=lambda nu, now: (
                nu + sign * k * np.maximum(derivative(now.drive, now.step), 0.0)
            ),
        ),
    )  # fmt: skip
