"""Which trials of an effect are worth a refit: their signatures beside what the base can absorb."""

import dataclasses
from collections.abc import Iterable

import numpy as np

from fitting.diagnosis.refit._effect_vector import effect_values, free_parameters
from fitting.diagnosis.refit._gauss_newton import Refit, SearchRanges, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel, acts_before_operator
from rapi_jax.effects import AbstractEffect, ResidualSummary

_BEYOND = 1.3  # the grid of its trials, that a parameter may go
_ALIKE = 0.98  # cosine from which two trials are one


@dataclasses.dataclass(frozen=True, eq=False)
class Screened:
    """One trial: by how much chi-square would fall at its best size, and what survives the base.

    - `fall`: with the operator's own Jacobian projected out; `fall_rich`: with the richer base's.
    - `survival`: length of what the richer base cannot absorb, over the whole signature's.
    - `left`: chi-square with the trial as it stands, the operator's own Jacobian projected out.
    - `direction`: what it changes beyond the operator's own Jacobian, of unit length.
    """

    effect: AbstractEffect
    fall: float
    fall_rich: float
    survival: float
    left: float
    direction: np.ndarray

    def alike(self, other: "Screened") -> bool:
        """Whether the two point the same way: a fit from one may end where the other's does."""
        return abs(float(self.direction @ other.direction)) > _ALIKE


def summarise_residual(whitened: WhitenedModel, state: State, noise: float) -> ResidualSummary:
    """What the effects may look at to choose their trials: all samples, one after the other."""
    blocks = whitened.blocks
    flat = [
        np.concatenate([part.ravel() for part in parts])
        for parts in (
            [b.time for b in blocks],
            [b.drive for b in blocks],
            [e + b.data for e, b in zip(state.errors.raw, blocks, strict=True)],
            [-e for e in state.errors.raw],
            [np.full(b.left.shape, k) for k, b in enumerate(blocks)],
        )
    ]
    drives = whitened.recording.drives
    return ResidualSummary(
        *flat,
        rates=tuple(d.rate for d in drives),
        u_pp=tuple(d.u_pp for d in drives),
        step_s=min(d.step_s for d in drives),
        noise=noise,
        span=float(np.ptp(flat[2])),
    )


def search_ranges(trials: Iterable[AbstractEffect]) -> SearchRanges:
    """How far the parameters of an effect may go: a little beyond the grid of its trials.

    Only for what the trials spread over: positive values that differ by more than a factor of two.
    What may be zero may always go there.
    """
    seen: dict[tuple[str, tuple[str | int, ...]], list[float]] = {}
    edges: dict[tuple[str, tuple[str | int, ...]], tuple[float, float]] = {}
    for trial in trials:
        for p, value in zip(free_parameters(trial), effect_values((trial,)), strict=True):
            seen.setdefault((trial.name, p.path), []).append(float(value))
            edges[trial.name, p.path] = (p.low, p.high)
    out: SearchRanges = {}
    for key, values in seen.items():
        least, most = min(values), max(values)
        low, high = edges[key]
        if least > 0 and np.isfinite(most) and most > 2.0 * least and low >= 0:
            out[key] = (max(least / _BEYOND, low) if low > 0 else 0.0, min(_BEYOND * most, high))
    return out


def orthonormal_basis(columns: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span what a base can change."""
    length = np.linalg.norm(columns, axis=0)
    left, size, _ = np.linalg.svd(columns[:, length > 0] / length[length > 0], full_matrices=False)
    return left[:, size > 1e-7 * size.max(initial=0.0)]


def screen_effect(
    refit: Refit,
    state: State,
    trials: Iterable[AbstractEffect],
    plain: np.ndarray,
    rich: np.ndarray,
) -> list[Screened]:
    """Every trial beside the state, the most promising first; `plain`, `rich`: see `basis`."""
    whitened, base = refit.whitened, refit.base
    synchronous, nonsynchronous = state.errors.synchronous, state.errors.nonsynchronous
    found = []
    for trial in trials:
        effects = (*state.effects, trial)
        ahead = acts_before_operator(trial)
        nodes = (
            whitened.operator_response(base.operator, state.values, effects)
            if ahead
            else state.operator_response
        )
        errors = whitened.evaluate_errors(refit.whitener, effects, nodes)
        s, t = errors.synchronous - synchronous, errors.nonsynchronous - nonsynchronous
        whole = float(s @ s + t @ t)
        if not np.isfinite(whole) or whole == 0:
            continue
        falls, left, beyond = [], 0.0, s
        with_it = synchronous + s
        along = plain.T @ with_it
        end = float(with_it @ with_it - along @ along + (nonsynchronous + t) @ (nonsynchronous + t))
        for q in (plain, rich):
            along = q.T @ s
            if q is plain:
                beyond = s - q @ along
            left = max(float(s @ s - along @ along), 0.0) + float(t @ t)
            inner = -float(s @ synchronous - along @ (q.T @ synchronous)) - float(
                t @ nonsynchronous
            )
            falls.append(inner**2 / left if left > 1e-12 * whole and inner > 0 else 0.0)
        way = np.concatenate([beyond, t]).astype(np.float32)
        way /= max(float(np.linalg.norm(way)), 1e-30)
        survival = float(np.sqrt(left / whole))
        found.append(Screened(trial, falls[0], falls[1], survival, end, way))
    return sorted(found, key=lambda one: -one.fall)
