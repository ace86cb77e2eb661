"""Third unlisted effects of the frequency's readout."""

import numpy as np

from fitting.blind.simulator._signal_path import Effect, RunState
from fitting.blind.simulator.effects._recipe import Array, Recipe, Setting, log_uniform


def count_from_first(counted: Array, nu: Array, now: RunState) -> Array:
    """A counter that is set to the true value at the run's first sample."""
    begin = int(np.argmin(np.abs(now.t - now.scan.start_s)))
    return counted - counted[begin] + nu[begin]


def count_late(nu: Array, step: float, late: float) -> Array:
    """Fringes counted from 0 in the direction that the scan had `late` s before."""
    moved = np.diff(nu, prepend=nu[0])
    t = np.arange(len(nu)) * step
    # The direction's integral, so that a turn may be noticed between two ticks.
    known = np.interp(t - late, t, np.cumsum(np.sign(moved)) * step)
    return np.cumsum(np.abs(moved) * np.diff(known, prepend=known[0]) / step)


def late_reversal(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A fringe counter learns late that the scan has turned; strength: how late, s."""
    del rng, setting
    return Recipe(
        name="unlisted:late_reversal", strength="late", low=1e-7, high=3e-3, parameters={},
        build=lambda x: Effect(
            "unlisted:late_reversal",
            light=lambda nu, now: count_from_first(count_late(nu, now.step, x), nu, now),
        ),
    )  # fmt: skip


def cycle_slips(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A phase meter slips by whole fringes, up or down, at random times; strength: a fringe, GHz.

    It is set to zero at the beginning of each run.
    """
    mean = log_uniform(rng, 0.1, 0.4)  # s between slips
    horizon = 3 * setting.end_s + 100
    times = np.cumsum(rng.exponential(mean, int(1.2 * horizon / mean) + 50))
    slips = np.concatenate(([0.0], np.cumsum(rng.choice([-1.0, 1.0], len(times)))))

    def build(x: float) -> Effect:
        def light(nu: Array, now: RunState) -> Array:
            return count_from_first(nu + x * slips[np.searchsorted(times, now.t)], nu, now)

        return Effect("unlisted:cycle_slips", light=light)

    return Recipe(
        name="unlisted:cycle_slips", strength="fringe", low=1e-3, high=3.0, build=build,
        parameters={"mean_s": mean},
    )  # fmt: skip


def held_means(nu: Array, t: Array, window: float, begin: float) -> Array:
    """At each time the mean of `nu` over the last window that has ended, `window` s long."""
    if window < 1e-3 * (t[1] - t[0]):  # no mean that double precision could tell
        return nu
    end = begin + window * np.floor((t - begin) / window)
    edges = np.maximum([end - window, end], t[0])
    total = np.concatenate(([0.0], np.cumsum((nu[1:] + nu[:-1]) / 2 * np.diff(t))))
    # Within a tick the integral of a straight line, a parabola.
    k = np.clip(np.searchsorted(t, edges, side="right") - 1, 0, len(t) - 2)
    since = edges - t[k]
    slope = (nu[k + 1] - nu[k]) / (t[k + 1] - t[k])
    first, last = total[k] + nu[k] * since + slope * since**2 / 2
    length = edges[1] - edges[0]
    return np.where(length > 0, (last - first) / np.maximum(length, 1e-300), nu[0])


def wavemeter(rng: np.random.Generator, setting: Setting) -> Recipe:
    """A wavemeter gives means over windows of its own clock, each till the next; strength: s."""
    del setting
    place = float(rng.uniform(0, 1))

    def build(x: float) -> Effect:
        return Effect(
            "unlisted:wavemeter",
            light=lambda nu, now: held_means(nu, now.t, x, place * x),
        )

    return Recipe(
        name="unlisted:wavemeter", strength="window", low=1e-6, high=1e-2, build=build,
        parameters={"place": place},
    )  # fmt: skip
