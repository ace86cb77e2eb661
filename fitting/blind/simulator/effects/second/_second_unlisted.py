"""More effects that no list holds: once unseen, for development now."""

import numpy as np

from fitting.blind.simulator._filters import delay_signal
from fitting.blind.simulator._signal_path import Effect, RunState
from fitting.blind.simulator.effects._recipe import Array, Maker, Recipe, Setting, log_uniform


def draw_events(rng: np.random.Generator, setting: Setting, mean: float) -> Array:
    """Random times in s on the session's clock and long after it, `mean` s apart."""
    horizon = 3 * setting.end_s + 100
    return np.cumsum(rng.exponential(mean, int(1.2 * horizon / mean) + 50))


def knocks(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The table is knocked at random times and rings down; strength: the typical first swing."""
    times = draw_events(rng, setting, log_uniform(rng, 0.15, 0.5))
    heights = rng.standard_normal(len(times))
    f, tau = log_uniform(rng, 15.0, 90.0), log_uniform(rng, 0.02, 0.1)

    def ringing(t: Array) -> Array:
        near = np.flatnonzero((times > t[0] - 15 * tau) & (times < t[-1]))
        total = np.zeros_like(t)
        for k in near.tolist():
            since = np.maximum(t - times[k], 0.0)
            total += heights[k] * np.exp(-since / tau) * np.sin(2 * np.pi * f * since)
        return total

    return Recipe(
        name="unlisted:knocks", strength="size", low=1e-3, high=10.0,
        parameters={"frequency": f, "decay": tau},
        build=lambda x: Effect("unlisted:knocks", light=lambda nu, now: nu + x * ringing(now.t)),
    )  # fmt: skip


def stale(rng: np.random.Generator, setting: Setting) -> Recipe:
    """The reading fails to be renewed at random times; strength: for how long, s."""
    mean = log_uniform(rng, 0.03, 0.15)
    times = draw_events(rng, setting, mean)

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            before = np.searchsorted(times, now.t, side="right") - 1
            last = times[np.maximum(before, 0)]
            held = (before >= 0) & (now.t - last < x) & (last >= now.t[0])
            return np.where(held, np.interp(last, now.t, nu), nu)

        return Effect("unlisted:stale", light=light)

    return Recipe(
        name="unlisted:stale", strength="duration", low=1e-5, high=2e-2, build=build,
        parameters={"mean_s": mean},
    )  # fmt: skip


def lost_counts(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A fringe counter that misses what passes too fast; strength: by how much, of the fastest."""
    del rng
    # Between its samples a reading is a little faster yet.
    fastest = 1.02 * max(
        float(np.max(np.abs(np.diff(nu)))) / scan.step_s
        for nu, scan in zip(setting.clean, setting.scans, strict=True)
    )

    def build(cut: float) -> Effect:
        limit = (1 - cut) * fastest

        def light(nu: Array, now: RunState) -> Array:
            most = limit * now.step
            # The counter is set to zero at the run's first sample.
            begin = int(np.argmin(np.abs(now.t - now.scan.start_s)))
            counted = np.cumsum(np.clip(np.diff(nu, prepend=nu[0]), -most, most))
            return counted - counted[begin] + nu[begin]

        return Effect("unlisted:lost_counts", light=light)

    return Recipe(
        name="unlisted:lost_counts", strength="cut", low=1e-5, high=0.7, build=build,
        parameters={"fastest": fastest},
    )  # fmt: skip


def subharmonic(rng: np.random.Generator, setting: Setting) -> Recipe:
    """Every other period differs: a parametric answer at half the drive's rate, as its swing."""
    reference, p = setting.widest.swing, float(rng.uniform(0, 2 * np.pi))

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            periods = now.scan.rate_hz * (now.t - now.scan.start_s) + now.scan.phase
            return nu + x * now.scan.swing / reference * np.sin(np.pi * periods + p)

        return Effect("unlisted:subharmonic", displacement=displacement)

    return Recipe(
        name="unlisted:subharmonic", strength="size", low=1e-3, high=3.0, build=build,
        parameters={"reference": reference, "phase": p},
    )  # fmt: skip


def echo(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A part of the displacement comes late, through the table; strength: that part."""
    del setting
    late = log_uniform(rng, 3e-3, 9e-3)

    def build(x: float) -> Effect:
        def displacement(nu: Array, now: RunState) -> Array:
            return nu + x * (delay_signal(nu, now.step, late) - nu)

        return Effect("unlisted:echo", displacement=displacement)

    return Recipe(
        name="unlisted:echo", strength="part", low=1e-5, high=0.5, build=build,
        parameters={"late_s": late},
    )  # fmt: skip


MORE_UNLISTED: dict[str, Maker] = {
    maker.__name__: maker for maker in (echo, knocks, lost_counts, stale, subharmonic)
}
