"""What the runs of a session carry over from one to the next: the states of slow linear effects."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact, Int

from rapi_jax.sampling._history import History

from ._lag_recursion import decay
from ._linear import ALWAYS_ON_S, Past


class Places(NamedTuple):
    """Where the state of each run is asked for.

    - `samples`: the first sample after the lead-in, two neighbours of a time within it, the last.
    - `along`: how far that time lies between the two: where the drive stood in its period when it
      was switched on.
    - `began_s`: time of the first sample after the lead-in, s. `lasts_s`: from there to the last.
    - `on_s`: for how long the drive had been on at `began_s`. `idle_s`: how long nothing was driven
      before that.
    """

    samples: Int[Array, "places runs"]
    along: Float[Array, " runs"]
    began_s: Float[Array, " runs"]
    lasts_s: Float[Array, " runs"]
    on_s: Float[Array, " runs"]
    idle_s: Float[Array, " runs"]

    @classmethod
    def of(cls, t: Float[Array, "time runs"], history: History, past: Past) -> "Places":
        runs, last = jnp.arange(t.shape[1]), t.shape[0] - 1
        began_s, joined = t[history.lead, runs], jnp.isfinite(history.gap_s)
        gap_s = jnp.where(joined, history.gap_s, 0.0)
        lead_s = past.lead_s + past.lead_periods * history.period_s
        longest = jnp.where(joined, gap_s, lead_s)
        rests = past.lead_s < ALWAYS_ON_S
        on_s = jnp.where(rests, jnp.minimum(lead_s, longest), gap_s)
        repeats = history.period_s > 0
        at_s = began_s - jnp.where(repeats, on_s % jnp.where(repeats, history.period_s, 1.0), 0.0)
        i = jnp.clip((t <= at_s[None]).sum(axis=0) - 1, 0, last - 1)
        step = t[i + 1, runs] - t[i, runs]
        along = (at_s - t[i, runs]) / jnp.where(step > 0, step, 1.0)
        samples = jnp.stack([history.lead.astype(i.dtype), i, i + 1, jnp.full_like(i, last)])
        idle_s = jnp.maximum(gap_s - on_s, 0.0)
        return cls(samples, along, began_s, t[-1] - began_s, on_s, idle_s)


def carried_states(
    x: Float[Array, "time runs"],
    lags: Inexact[Array, "places runs modes"],
    rate: Inexact[Array, " modes"],
    places: Places,
    history: History,
    past: Past,
) -> Inexact[Array, "runs modes"]:
    """Offsets of each run's states at its first sample after the lead-in.

    `lags`: those of each run alone at `places`, from its first value.
    """
    lags = lags + x[0][None, :, None].astype(rate.dtype)
    at_lead = x[places.samples[0], jnp.arange(x.shape[1])][:, None].astype(rate.dtype)
    at = lags[1] + places.along[:, None].astype(rate.dtype) * (lags[2] - lags[1])
    rest = (past.rest * jnp.ptp(x[:, 0])).astype(rate.dtype)
    joined = jnp.isfinite(history.gap_s)
    unsettled = jnp.where(joined, 1.0, 1.0 - past.settled)[:, None]
    fade = unsettled * decay(places.on_s[:, None], rate)
    idle = decay(places.idle_s[:, None], rate)
    end = decay(places.lasts_s[:, None], rate)
    level = at_lead[0] + rest

    def one(before, run):
        joined, at_lead, at, idle, fade, end, last = run
        began = jnp.where(joined, level + idle * (before - level), at_lead + rest)
        off = fade * (began - at)
        return last + end * off, off

    rows = (joined, at_lead, at, idle, fade, end, lags[3])
    return jax.lax.scan(one, jnp.zeros_like(lags[0, 0]), rows)[1]
