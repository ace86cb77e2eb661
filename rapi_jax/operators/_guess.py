"""Initial guesses by random search: shapes of the memory function drawn, the rest solved for."""

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from itertools import zip_longest
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from rapi_jax._errors import DataError
from rapi_jax._precision import as_float64
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.sampling._batch import Batch, to_batch
from rapi_jax.sampling._phase import turning_samples

from ._base import AbstractOperator
from ._thresholds import THRESHOLDS

Operator = TypeVar("Operator", bound=AbstractOperator)

_SEED = 20260101


@dataclasses.dataclass(frozen=True)
class Trial:
    """A shape of the memory function, and how well it explains the data, the rest solved for."""

    fields: dict[str, float]
    d_0: float
    d: np.ndarray
    scale: float  # what the memory function was multiplied by: `a`, or every weight
    cost: float  # share of the variance that a polynomial leaves and this trial does not explain


def thinned(data: Batch, drives: Sequence[Drive]) -> list[tuple[int, np.ndarray]]:
    """For each run, the row and the columns of about 256 samples of its first period.

    Turning points are kept, and a drive that repeats begins at its minimum, where Eq. 13 is the
    periodic state, so the plays see the same history.
    """
    kept = []
    for row, drive in enumerate(drives):
        inside = np.flatnonzero(data.sample[row] >= 0)
        used = np.flatnonzero(data.use[row])
        if not used.size:
            raise DataError(
                f"run {row + 1} of {data.u.shape[0]} has no sample to fit: no complete period, or "
                "no valid reading."
            )
        end = inside[-1]
        if data.freq[row] > 0:
            step = data.time[row, 1] - data.time[row, 0]
            end = min(end, used[0] + round(1.0 / (data.freq[row] * step)))
        columns = np.arange(end + 1)
        if drive.whole_period:
            first = int(np.searchsorted(inside, used[0]))
            last = min(first + drive.whole_period, inside.size) - 1
            columns = np.arange(used[0], inside[last] + 1)
            columns = np.roll(columns, -int(np.argmin(data.u[row, columns])))
        u = data.u[row, columns]
        every = np.unique(np.linspace(0, u.size - 1, THRESHOLDS.guess_samples).astype(int))
        turns = turning_samples(u) if np.ptp(u) > 0 else every[:1]
        kept.append((row, columns[np.union1d(every, turns)]))
    return kept


def basis(u: np.ndarray, order: int, groups: np.ndarray) -> np.ndarray:
    """Columns of the memoryless part: a constant for each group of samples, then powers of `u`."""
    constants = (groups[:, None] == np.unique(groups)[None, :]).astype(float)
    return np.concatenate([constants, u[:, None] ** np.arange(1, order + 1)], axis=1)


def evaluate_guesses(
    recording: Recording,
    respond: Callable[..., tuple[Array, Array]],
    fields: Sequence[dict[str, float]],
    order: int,
    count: int,
) -> list[Trial]:
    """The `count` best shapes of memory function, each with its scale and polynomial solved for.

    The best of all is the first, and each side of symmetry has its best among the next, see
    `_in_turn`. `respond` takes drives, rates, peaks to peak and minima of the runs, and gives the
    response of each shape's memory, in the order of `fields`, and the drives from the origin that
    all share.
    """
    data = to_batch(recording)
    kept = thinned(data, recording.drives)
    width = max(columns.size for _, columns in kept)
    padded = [np.pad(columns, (0, width - columns.size), "edge") for _, columns in kept]
    use = np.stack(
        [
            data.use[row, columns] & (np.arange(width) < kept[row][1].size)
            for row, columns in enumerate(padded)
        ]
    )
    u = np.stack([data.u[row, columns] for row, columns in enumerate(padded)])
    h, centred = map(np.asarray, respond(*map(as_float64, (u, data.freq, data.u_pp, data.u_min))))
    y = np.stack([data.y[row, columns] for row, columns in enumerate(padded)])[use]
    groups = np.broadcast_to(np.arange(u.shape[0])[:, None], u.shape)[use]
    if recording.response_origin == "session":
        groups = np.zeros_like(groups)
    fixed = basis(centred[use], order, groups)
    q, _ = np.linalg.qr(fixed / np.maximum(np.linalg.norm(fixed, axis=0), 1e-300))
    rest = y - q @ (q.T @ y)
    power = max(float(rest @ rest), 1e-300)
    h = h[:, use]
    orthogonal = h - (h @ q) @ q.T
    norm = (orthogonal**2).sum(axis=1)
    scale = np.maximum(orthogonal @ rest, 0.0) / np.where(norm > 0, norm, np.inf)
    cost = ((rest - scale[:, None] * orthogonal) ** 2).sum(axis=1) / power
    found = []
    for i in _in_turn(cost, fields)[:count]:
        solved = np.linalg.lstsq(fixed, y - scale[i] * h[i], rcond=1e-12)[0]
        constants = solved[: fixed.shape[1] - order]
        d_0 = float(constants.mean())
        found.append(Trial(fields[i], d_0, solved[-order:], float(scale[i]), float(cost[i])))
    return found


def _in_turn(cost: np.ndarray, fields: Sequence[dict[str, float]]) -> list[int]:
    """Trials from the least cost up, in turn of plays with `lam` below, about and above 1.

    A fit seldom passes from one of these sides to another: where `lam` is 1 a play is symmetric,
    and a polynomial makes up for much of what the wrong side bends. By cost alone all guesses may
    be of one side. At one rate and one swing 2 of 31 simulated devices without effects had only
    guesses below 1, from which no fit came nearer than 1000 of chi-square a line; from one above
    1 the same fit reached 1.3 and 29.
    """
    sides: dict[int, list[int]] = {}
    for i in np.argsort(cost, kind="stable").tolist():
        ratio = np.log(fields[i].get("lam", 1.0)) / np.log(THRESHOLDS.guess_symmetry)
        sides.setdefault(int(np.clip(np.fix(ratio), -1.0, 1.0)), []).append(i)
    rows = zip_longest(*sides.values())
    return [i for row in rows for i in row if i is not None]


@eqx.filter_jit
def one_response(operator, *runs):
    """Response of the operator's memory to all runs, and their drives from its origin."""
    return _response(operator, *runs)[None], operator.centred(runs[0])


@eqx.filter_jit
def _drawn_responses(build, columns, *runs):
    """The same of many shapes of memory function, one after the other."""
    responses, centred = jax.lax.map(
        lambda fields: (_response(build(fields), *runs), build(fields).centred(runs[0])), columns
    )
    return responses, centred[0]


def _response(operator, u, freq, u_pp, u_min):
    runs = jax.vmap(operator.hysteresis, in_axes=(0, 0, None, 0, 0))
    return runs(u, freq, None, u_pp, u_min)


class _Family(eqx.Module):
    """Operators of one size, by the fields drawn."""

    build: Callable[..., Any]
    plays: int = eqx.field(static=True)
    order: int = eqx.field(static=True)
    each: frozenset[str] = eqx.field(static=True)

    def __call__(self, fields: dict[str, Any], a: Any = 1.0, d: Any = None, d_0: Any = 0.0) -> Any:
        wide = {
            k: jnp.broadcast_to(v, self.plays) if k in self.each else v for k, v in fields.items()
        }
        d = np.zeros(self.order) if d is None else d
        return self.build(**wide, a=a, d=d, d_0=d_0, plays=self.plays)


def draw(recording: Recording, trial: int) -> dict[str, float]:
    """One shape of the memory function, drawn over the ranges that piezo devices show."""
    limits = THRESHOLDS
    rng = np.random.default_rng((_SEED, trial))
    u_pp = max(max(d.u_pp for d in recording.drives), 1e-12)
    fastest = max(recording.rates)
    alpha = _draw_logarithmic(rng, limits.alpha_range)
    grows = not recording.one_rate and fastest > 0
    growth = float(rng.uniform(*limits.growth_range)) if grows else 0.0
    lam = _draw_logarithmic(rng, limits.lam_range) if trial % limits.lam_shared else 1.0
    decay = float(rng.uniform(*limits.decay_range)) if trial % limits.decay_absent else 0.0
    return {
        "alpha": alpha,
        "zeta": growth * alpha * u_pp / 2.0 / fastest if growth else 0.0,
        "lam": lam,
        "eta": 1.0,
        "b": decay * 2.0 / u_pp,
    }


def _draw_logarithmic(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(np.log(limits[0]), np.log(limits[1]))))


def _scaled(fields: dict[str, float], trial: int) -> dict[str, float]:
    """Thresholds that grow with the swing, as they are drawn."""
    del trial
    return fields


def guess_shapes(
    build: Callable[..., Operator],
    recording: Recording,
    *,
    plays: int,
    order: int,
    each: Sequence[str],
    count: int,
    law: Callable[[dict[str, float], int], dict[str, float]] = _scaled,
) -> list[Operator]:
    """The `count` best of the RA-PI family: shapes drawn, scale and polynomial solved for.

    `build` makes one from the parameters of `RAPI`, or from those that `law` makes of them (drawn
    fields and number of the trial in, fields out); `each` names those with a value for each play.
    Call with 64-bit types on.
    """
    drawn = [law(draw(recording, i), i) for i in range(THRESHOLDS.guess_trials)]
    allowed = [name for name in ("alpha", "rho", "lam", "eta") if name in drawn[0]]
    unknown = set(each) - set(allowed)
    if unknown:
        *first, last = allowed
        raise ValueError(
            f"Argument `each` may name {', '.join(first)} and {last}, but names {unknown}."
        )

    family = _Family(build, plays, order, frozenset(each))
    columns = {name: as_float64([fields[name] for fields in drawn]) for name in drawn[0]}
    respond = partial(_drawn_responses, family, columns)
    found = evaluate_guesses(recording, respond, drawn, order, count)
    return [family(t.fields, t.scale, t.d, t.d_0) for t in found]


def middle_drive(recording: Recording) -> float:
    """The mean over runs of the middle of the drive's range."""
    return float(np.mean([(d.value.max() + d.value.min()) / 2.0 for d in recording.drives]))


def largest_half_swing(recording: Recording) -> float:
    """Half the largest peak-to-peak drive, in the drive's unit."""
    return max(max(d.u_pp for d in recording.drives), 1e-12) / 2.0
