"""Initial guesses by random search: shapes of the memory function drawn, the rest solved for."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rapi_jax._errors import DataError
from rapi_jax._recording import Recording
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


def thinned(data: Batch) -> list[tuple[int, np.ndarray]]:
    """For each run, the row and the columns of about 256 samples of its first period.

    Turning points are kept, so the plays see the same history.
    """
    kept = []
    for row in range(data.u.shape[0]):
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
        every = np.unique(np.linspace(0, end, THRESHOLDS.guess_samples).astype(int))
        turns = turning_samples(data.u[row, : end + 1]) if np.ptp(data.u[row]) > 0 else every[:1]
        kept.append((row, np.union1d(every, turns)))
    return kept


def basis(u: np.ndarray, order: int, groups: np.ndarray) -> np.ndarray:
    """Columns of the memoryless part: a constant for each group of samples, then powers of `u`."""
    constants = (groups[:, None] == np.unique(groups)[None, :]).astype(float)
    return np.concatenate([constants, u[:, None] ** np.arange(1, order + 1)], axis=1)


def evaluate_guesses(
    recording: Recording, shapes: Sequence[tuple[dict[str, float], AbstractOperator]], order: int
) -> list[Trial]:
    """Each shape of memory function with its scale and polynomial solved for, best first.

    The shapes have one origin.
    """
    data = to_batch(recording)
    kept = thinned(data)
    width = max(columns.size for _, columns in kept)
    padded = [np.pad(columns, (0, width - columns.size), "edge") for _, columns in kept]
    use = np.stack(
        [
            data.use[row, columns] & (np.arange(width) < kept[row][1].size)
            for row, columns in enumerate(padded)
        ]
    )
    u = np.stack([data.u[row, columns] for row, columns in enumerate(padded)])
    centred = np.asarray(shapes[0][1].centred(jnp.asarray(u)))
    y = np.stack([data.y[row, columns] for row, columns in enumerate(padded)])[use]
    groups = np.broadcast_to(np.arange(u.shape[0])[:, None], u.shape)[use]
    if recording.response_origin == "session":
        groups = np.zeros_like(groups)
    fixed = basis(centred[use], order, groups)
    q, _ = np.linalg.qr(fixed / np.maximum(np.linalg.norm(fixed, axis=0), 1e-300))
    rest = y - q @ (q.T @ y)
    power = max(float(rest @ rest), 1e-300)
    rows = [jnp.asarray(a) for a in (u, data.freq, data.u_pp, data.u_min)]
    found = []
    for fields, operator in shapes:
        h = np.asarray(_all_runs(operator, *rows))[use]
        orthogonal = h - q @ (q.T @ h)
        norm = float(orthogonal @ orthogonal)
        scale = max(float(orthogonal @ rest) / norm, 0.0) if norm > 0 else 0.0
        left = rest - scale * orthogonal
        solved = np.linalg.lstsq(fixed, y - scale * h, rcond=1e-12)[0]
        constants = solved[: fixed.shape[1] - order]
        found.append(
            Trial(
                fields, float(constants.mean()), solved[-order:], scale, float(left @ left) / power
            )
        )
    return sorted(found, key=lambda trial: trial.cost)


@eqx.filter_jit
def _all_runs(operator, u, freq, u_pp, u_min):
    return jax.vmap(operator.hysteresis, in_axes=(0, 0, None, 0, 0))(u, freq, None, u_pp, u_min)


def draw(recording: Recording, trial: int) -> dict[str, float]:
    """One shape of the memory function, drawn over the ranges that piezo devices show."""
    limits = THRESHOLDS
    rng = np.random.default_rng((_SEED, trial))
    u_pp = max(max(d.u_pp for d in recording.drives), 1e-12)
    fastest = max(recording.rates)
    alpha = _draw_logarithmic(rng, limits.alpha_range)
    grows = len(recording.rates) > 1 and fastest > 0
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


def guess_shapes(
    build: Callable[..., Operator],
    recording: Recording,
    *,
    plays: int,
    order: int,
    each: Sequence[str],
    count: int,
) -> list[Operator]:
    """The `count` best of the RA-PI family: shapes drawn, scale and polynomial solved for.

    `build` makes one from the parameters of `RAPI`; `each` names those with a value for each play.
    Call with 64-bit types on.
    """
    unknown = set(each) - {"alpha", "lam", "eta"}
    if unknown:
        raise ValueError(f"Argument `each` may name alpha, lam and eta, but names {unknown}.")

    def operator(fields: dict[str, float], a: float, d: Any, d_0: float) -> Operator:
        wide = {k: np.full(plays, v) if k in each else v for k, v in fields.items()}
        return build(**wide, a=a, d=d, d_0=d_0, plays=plays)

    drawn = [draw(recording, i) for i in range(THRESHOLDS.guess_trials)]
    shapes = [(f, operator(f, 1.0, np.zeros(order), 0.0)) for f in drawn]
    found = evaluate_guesses(recording, shapes, order)
    return [operator(t.fields, t.scale, t.d, t.d_0) for t in found[:count]]


def middle_drive(recording: Recording) -> float:
    """The mean over runs of the middle of the drive's range."""
    return float(np.mean([(d.value.max() + d.value.min()) / 2.0 for d in recording.drives]))
