"""Second forms of listed effects on the displacement and on the light."""

import numpy as np
from scipy import optimize, special

from fitting.blind.simulator._filters import derivative, rational_filter, second_order
from fitting.blind.simulator._signal_path import Effect, RunState, mean_at_crossings
from fitting.blind.simulator.effects._listed_optical import creep_response, hop_places, hop_states
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, drive_range, log_uniform


def stretched_exponential(tau: float, beta: float) -> tuple[Array, Array]:
    """Lags, and weights of sum 1, that answer a step as `1 - exp(-(t/tau)^beta)`."""
    taus = tau * np.geomspace(1e-6, 30.0, 25)
    t = tau * np.geomspace(1e-6, 100.0, 400)
    # Neighbours are nearly alike: a little damping keeps all weights smooth.
    matrix = np.vstack([np.exp(-t[:, None] / taus), 0.01 * np.eye(taus.size)])
    wanted = np.concatenate([np.exp(-((t / tau) ** beta)), np.zeros(taus.size)])
    weights, _ = optimize.nnls(matrix, wanted, maxiter=1000)
    kept = weights > 1e-6
    return taus[kept], weights[kept] / weights[kept].sum()


def creep(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A stretched exponential in place of the logarithm; strength: its end value."""
    del setting
    tau, beta = log_uniform(rng, 0.1, 2.0), float(rng.uniform(0.35, 0.6))
    taus, weights = stretched_exponential(tau, beta)
    return Recipe(
        name="creep", strength="gain", low=5e-4, high=0.2,
        parameters={"form": "stretched", "tau": tau, "beta": beta},
        build=lambda g: Effect(
            "creep",
            displacement=lambda nu, now: nu + g * creep_response(nu - now.rest, now, taus, weights),
        ),
    )  # fmt: skip


def resonance(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A mode whose frequency shifts from run to run as its clamp warms; strength: 1/f0 at first."""
    z, tau = log_uniform(rng, 0.015, 0.1), setting.end_s * log_uniform(rng, 0.3, 1.0)
    shift = float(rng.uniform(0.03, 0.12)) * float(rng.choice([-1, 1]))

    def build(period: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            warm = -float(np.expm1(-now.scan.start_s / tau))
            return rational_filter(
                nu, now.step, [1.0], second_order((1 + shift * warm) / period, z)
            )

        return Effect("resonance", displacement=displacement)

    return Recipe(
        name="resonance", strength="period", low=1 / 25e3, high=1 / 150.0, build=build,
        parameters={"form": "shifting", "damping": z, "shift": shift, "warming_s": tau},
    )  # fmt: skip


def drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Heat that diffuses in from some moment on, `erfc sqrt(tau/t)`; strength: its end value."""
    onset, tau = setting.end_s * rng.uniform([-0.1, 0.05], [0.4, 0.5])
    sign = 1 if rng.random() < 0.5 else -1

    def light(nu: Array, now: RunState, x: float) -> Array:
        since = np.maximum(now.t - onset, 1e-9)
        return nu + sign * x * special.erfc(np.sqrt(tau / since))

    return Recipe(
        name="drift", strength="size", low=1e-3, high=6.0,
        parameters={"form": "diffusion", "onset": float(onset), "tau": float(tau), "sign": sign},
        build=lambda x: Effect("drift", light=lambda nu, now: light(nu, now, x)),
    )  # fmt: skip


def gain_drift(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The gain goes up and down with a slow cycle of the room; strength: its amplitude."""
    cycle = setting.end_s * log_uniform(rng, 0.5, 1.5)
    p = float(rng.uniform(0, 2 * np.pi))

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            centre = mean_at_crossings(now.operator_response, now.drive, now.scan.bias)
            return centre + (nu - centre) * (1 + x * np.sin(2 * np.pi * now.t / cycle + p))

        return Effect("gain_drift", light=light)

    return Recipe(
        name="gain_drift", strength="amplitude", low=1e-5, high=0.03, build=build,
        parameters={"form": "cycle", "cycle_s": cycle, "phase": p},
    )  # fmt: skip


def mode_hop(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Two hops of one size, the second further on: the span holds two mode boundaries."""
    up, down = hop_places(rng, setting)
    sign = 1 if rng.random() < 0.5 else -1
    second = up + float(rng.uniform(0.3, 0.7)) * (float(np.max(setting.pooled)) - up)
    width = up - down

    def build(jump: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            del now
            count = hop_states(nu, up, down).astype(float) + hop_states(nu, second, second - width)
            return nu + sign * jump * count

        return Effect("mode_hop", light=light)

    return Recipe(
        name="mode_hop", strength="jump", low=0.2, high=4.0, build=build,
        parameters={"form": "two", "up": up, "second": second, "width": width, "sign": sign},
    )  # fmt: skip


def etalon(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Two cavities of nearly one length: fringes that beat."""
    spacing = log_uniform(rng, 1.5, max(3.0, 0.3 * float(np.ptp(setting.pooled))))
    ratio, share = log_uniform(rng, 1.1, 1.4), float(rng.uniform(0.5, 0.9))
    p, q = rng.uniform(0, 2 * np.pi, 2).tolist()

    def fringes(nu: Array) -> Array:
        turn = 2 * np.pi * nu / spacing
        return np.sin(turn + p) + share * np.sin(ratio * turn + q)

    return Recipe(
        name="etalon", strength="amplitude", low=1e-3, high=0.5,
        parameters={"form": "two", "spacing": spacing, "ratio": ratio, "share": share,
                    "phase": p, "phase_second": q},
        build=lambda x: Effect("etalon", light=lambda nu, now: nu + x * fringes(nu)),
    )  # fmt: skip


def pickup(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Pulses of a dimmer: two a cycle of the line, of opposite signs; strength: their height."""
    del setting
    f, width = float(rng.choice([50.0, 60.0])), log_uniform(rng, 4e-4, 1.5e-3)
    begin = float(rng.uniform(0, 1 / f))

    def pulses(t: Array) -> Array:
        half = 0.5 / f
        number = np.round((t - begin) / half)
        far = (t - begin) - number * half
        return np.where(number % 2 == 0, 1.0, -1.0) * np.exp(-0.5 * (far / width) ** 2)

    return Recipe(
        name="pickup", strength="height", low=1e-4, high=3.0,
        parameters={"form": "pulses", "frequency": f, "width": width, "begin": begin},
        build=lambda x: Effect("pickup", light=lambda nu, now: nu + x * pulses(now.t)),
    )  # fmt: skip


def current_coupling(rng: np.random.Generator, setting: Setting) -> Recipe:
    """`k(u) du/dt`: the current into a capacitance that grows with the voltage."""
    low, high = drive_range(setting.scans)
    bend = float(rng.uniform(0.2, 0.6))
    sign = 1 if rng.random() < 0.5 else -1

    def build(k: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            height = (now.drive - low) / (high - low)
            return nu + sign * k * (1 + bend * (2 * height - 1)) * derivative(now.drive, now.step)

        return Effect("current_coupling", light=light)

    return Recipe(
        name="current_coupling", strength="k", low=1e-7, high=1e-2, build=build,
        parameters={"form": "by height", "bend": bend, "sign": sign},
    )  # fmt: skip
