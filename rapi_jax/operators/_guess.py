"""A first model from the data alone: many shapes of memory function, the rest solved for."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rapi_jax._errors import DataError
from rapi_jax._recording import Recording
from rapi_jax.sampling._batch import Batch, to_batch
from rapi_jax.sampling._phase import turning_samples

from ._base import AbstractOperator

_SAMPLES = 256  # a run is thinned to about so many samples; plays only feel the turning points
TRIALS = 384
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
    """For each run, the row and the columns of about `_SAMPLES` samples of its first period.

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
        every = np.unique(np.linspace(0, end, _SAMPLES).astype(int))
        turns = turning_samples(data.u[row, : end + 1]) if np.ptp(data.u[row]) > 0 else every[:1]
        kept.append((row, np.union1d(every, turns)))
    return kept


def basis(u: np.ndarray, order: int, groups: np.ndarray) -> np.ndarray:
    """Columns of the memoryless part: a constant for each group of samples, then powers of `u`."""
    constants = (groups[:, None] == np.unique(groups)[None, :]).astype(float)
    return np.concatenate([constants, u[:, None] ** np.arange(1, order + 1)], axis=1)


def trials(
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
    rng = np.random.default_rng((_SEED, trial))
    u_pp = max(max(d.u_pp for d in recording.drives), 1e-12)
    fastest = max(recording.rates)
    alpha = float(np.exp(rng.uniform(np.log(0.03), np.log(0.9))))
    growth = float(rng.uniform(0.0, 0.6)) if len(recording.rates) > 1 and fastest > 0 else 0.0
    lam = float(np.exp(rng.uniform(np.log(0.4), np.log(2.5)))) if trial % 4 else 1.0
    decay = float(rng.uniform(-0.5, 3.0)) if trial % 3 else 0.0
    return {
        "alpha": alpha,
        "zeta": growth * alpha * u_pp / 2.0 / fastest if growth else 0.0,
        "lam": lam,
        "eta": 1.0,
        "b": decay * 2.0 / u_pp,
    }
