"""Responses of the plays that a density holds: about the operator's own, each a column.

A weight enters the response linearly. What is not linear in a device unlike the operator
(slopes, openings, growth with scan rate, decay of the weights, bent bounds) is covered by plays
beside each threshold that differ from it in one or two of these. A Preisach operator whose density
is a product of one in half-width and one in bias is a sum of plays, each bent by the integral of
the latter (Brokate and Sprekels 1996), so powers of the plays' outputs stand beside them.
"""

from collections.abc import Iterator

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from fitting.diagnosis.refit._compiled_stages import OperatorInput
from rapi_jax import AbstractOperator

from ._play_outputs import PlayShapes, play_outputs, telling_samples
from ._thresholds import THRESHOLDS

_LAM, _ETA, _GROWTH = THRESHOLDS.lam_step, THRESHOLDS.eta_step, THRESHOLDS.growth_step
# Changes of slope, opening, growth and bend of each variant; all less the play as it is.
VARIANTS: tuple[tuple[float, float, float, float], ...] = (
    *((sign * _LAM, 0.0, 0.0, 0.0) for sign in (-1, 1)),
    *((0.0, sign * _ETA, 0.0, 0.0) for sign in (-1, 1)),
    *((0.0, 0.0, sign * _GROWTH, 0.0) for sign in (-1, 1)),
    *((0.0, 0.0, 0.0, sign * THRESHOLDS.bow_step) for sign in (-1, 1)),
    *((a * _LAM, 0.0, b * _GROWTH, 0.0) for a in (-1, 1) for b in (-1, 1)),
    *((a * _LAM, b * _ETA, 0.0, 0.0) for a in (-1, 1) for b in (-1, 1)),
)


Plays = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
BENDS = (2, 3, 4, 5)
"""Powers of a play's output about the middle of the drive's range."""


def density_columns(
    operator: AbstractOperator,
    given: OperatorInput,
    known_start: Bool[np.ndarray, " runs"],
    place: Int[np.ndarray, "runs time"],
) -> Iterator[tuple[int, Float[np.ndarray, "columns runs time"]]]:
    """The columns, some at a time: plays of the operator's mean weight, and powers of the drive.

    Each with its kind, in order: 0 for plays unlike the operator's, 1 finer ones, 2 bent ones.
    `known_start`: whether Eq. 13 holds for a run; else plays begin in the middle of their bands.
    `place`: which of the drive's samples are asked for.
    """
    u = np.asarray(operator.centred(given.u))
    u_min = np.asarray(operator.centred(given.u_min))
    law = given.law
    gain = np.asarray(law.gain)[:, None]
    swings, rates = np.asarray(law.u_pp), np.asarray(law.freq)
    runs = _runs(operator, swings, rates, THRESHOLDS.plays)
    widest = max(float(r.max()) for r, *_ in runs)
    weight = _mean_weight(operator, float(law.u_pp[0]), float(law.freq[0]))
    centre = (float(u.max()) + float(u.min())) / 2.0
    half = max((float(u.max()) - float(u.min())) / 2.0, 1e-12)
    telling = [telling_samples(row, at) for row, at in zip(u, place, strict=True)]
    drives = [row[samples] for row, (samples, _) in zip(u, telling, strict=True)]
    u = np.take_along_axis(u, place, axis=1)

    def outputs(
        change: tuple[float, float, float, float], of: list[Plays] = runs
    ) -> tuple[np.ndarray, np.ndarray]:
        lam, eta, growth, bow = change
        rows, thresholds = [], []
        for k, (r, rate_part, slope, opening) in enumerate(of):
            shapes = PlayShapes(
                np.maximum(r + growth * rate_part, 0.0),
                slope * (1.0 + lam),
                opening * (1.0 + eta),
                np.full(r.size, bow / half),
                centre,
            )
            begin = float(u_min[k]) if known_start[k] else None
            rows.append(play_outputs(drives[k], shapes, begin)[:, telling[k][1]])
            thresholds.append(shapes.r)
        return weight * gain * np.stack(rows, axis=1), np.stack(thresholds, axis=1) / widest

    own, share = outputs((0.0, 0.0, 0.0, 0.0))
    yield 0, own
    for decay in THRESHOLDS.decays:
        yield 0, own * np.exp(-decay * share)[:, :, None]
    for change in VARIANTS:
        yield 0, outputs(change)[0] - own
    for sign in (-1, 1):
        steeper, share = outputs((sign * _LAM, 0.0, 0.0, 0.0))
        yield 0, (steeper - own) * np.exp(-0.5 * share)[:, :, None]
    powers = [((u - centre) / half) ** k for k in range(2, THRESHOLDS.order + 1)]
    yield 0, weight * half * gain * np.stack(powers)
    fine = _runs(operator, swings, rates, THRESHOLDS.fine_plays)
    part = THRESHOLDS.plays / THRESHOLDS.fine_plays
    yield 1, part * outputs((0.0, 0.0, 0.0, 0.0), fine)[0]
    about = (own / (weight * gain) - centre) / half
    for power in BENDS:
        bent = THRESHOLDS.bend_step * weight * half * gain * about**power
        yield 2, bent
        yield 2, bent.sum(axis=0, keepdims=True)  # all plays alike


def _runs(
    operator: AbstractOperator, u_pp: np.ndarray, freq: np.ndarray, count: int
) -> list[Plays]:
    """Of each run: thresholds, their part that grows with rate, slopes and openings.

    On a grid over the operator's own thresholds and beyond; slopes and openings in between.
    """
    grid = THRESHOLDS.reach * (np.arange(count) + 0.7) / count
    out = []
    for swing, rate in zip(u_pp, freq, strict=True):
        plays = operator.plays(jnp.asarray(swing), jnp.asarray(rate))
        still = np.asarray(operator.plays(jnp.asarray(swing), jnp.asarray(0.0)).r)
        order, top = np.argsort(still), max(float(still.max()), 1e-12)
        place = still[order] / top

        def between(values: np.ndarray, place=place, order=order) -> np.ndarray:
            return np.interp(grid, place, np.asarray(values)[order])

        rate_part = between(np.asarray(plays.r) - still)
        out.append(
            (
                grid * top + rate_part,
                rate_part,
                between(np.asarray(plays.lam)),
                between(np.asarray(plays.eta)),
            )
        )
    return out


def _mean_weight(operator: AbstractOperator, u_pp: float, freq: float) -> float:
    """All of the plays' weight spread over the density's, in the response's unit a V."""
    plays = operator.plays(jnp.asarray(u_pp), jnp.asarray(freq))
    return max(float(np.abs(np.asarray(plays.p)).sum()) / THRESHOLDS.plays, 1e-12)
