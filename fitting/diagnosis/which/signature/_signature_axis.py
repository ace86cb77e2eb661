"""The axis of a signature: in which bin of it each reading of a recording falls."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.where._branches import branches, scan_phase
from fitting.diagnosis.where._residual_profiles import since_turn_edges, time_since_turn
from rapi_jax import Recording
from rapi_jax.effects import AbstractEffect, SignatureAxis

_BINS = 60  # of the pictures
_FOLDS = 3.0  # periods along an axis from which a signature is folded: fewer are seen one by one


@dataclasses.dataclass(frozen=True, eq=False)
class Places:
    """Bins of one axis, and where in them the readings fall.

    - `axis`, `unit`: of `x`, the middle of each bin. `period`: by which it is folded, or `None`.
    - `rows`: by name, for each run the bin of each reading; -1 outside the row.
    """

    axis: SignatureAxis
    unit: str
    period: float | None
    x: Float[np.ndarray, " bins"]
    rows: dict[str, list[Int[np.ndarray, "_ _"]]]


def place_samples(
    effect: AbstractEffect,
    model: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    recording: Recording,
) -> Places:
    """Where the readings fall along the signature axis of `effect`.

    `model`: the response without noise ("periods phases" a run). Bins of the axis: of `since_turn`
    they grow with time; of the `session` and the `gain` each is a period, but where the signature
    repeats in time. Rows are directions, turns and rates, or runs, wherever the axis has some.
    """
    axis, period = effect.signature_axis, effect.signature_period()
    if axis == "since_turn":
        return _since_turn(blocks, recording)
    if axis == "phase":
        rows = {}
        for k, block in enumerate(blocks):
            phase = scan_phase(recording.runs[k].drive, block)
            at = np.minimum((phase * _BINS + 1e-9).astype(int), _BINS - 1)
            name = recording.runs[k].name
            rows[name] = _in_run(k, np.broadcast_to(at, block.data.shape), blocks)
        return Places(axis, "1", None, (np.arange(_BINS) + 0.5) / _BINS, rows)
    if axis in ("response", "drive"):
        values = model if axis == "response" else [b.drive for b in blocks]
        unit = recording.response_unit if axis == "response" else recording.drive_unit
        x, period, at = _linear(values, period)
        up = [branches(recording.runs[k].drive, b)[0] for k, b in enumerate(blocks)]
        rows = {
            name: [np.where((u == rising)[None, :], a, -1) for a, u in zip(at, up, strict=True)]
            for name, rising in (("up", True), ("down", False))
        }
        return Places(axis, unit, period, x, rows)
    if period is not None:
        x, period, at = _linear([b.time for b in blocks], period)
        return Places(axis, "s", period, x, {"": at})
    return _by_period(axis, blocks)


def _linear(
    values: list[np.ndarray], period: float | None
) -> tuple[np.ndarray, float | None, list[np.ndarray]]:
    """Bins of equal width, folded where `period` goes into the range several times."""
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    span = max(high - low, 1e-300)
    if period is None or not 0.0 < period * _FOLDS < span:
        period = None
    else:
        low, span = 0.0, period
        values = [np.mod(v, period) for v in values]
    at = [np.clip(((v - low) / span * _BINS).astype(int), 0, _BINS - 1) for v in values]
    return low + span * (np.arange(_BINS) + 0.5) / _BINS, period, at


def _since_turn(blocks: list[PeriodBlock], recording: Recording) -> Places:
    found = [time_since_turn(recording.runs[k].drive, b) for k, b in enumerate(blocks)]
    edges = since_turn_edges([seconds for _, seconds in found], blocks)
    rows: dict[str, list[np.ndarray]] = {}
    for k, (up, seconds) in enumerate(found):
        at = np.digitize(seconds, edges) - 1  # -1 at the turn itself
        rate = recording.runs[k].drive.excitation_hz
        for turn, rising in (("low", True), ("high", False)):
            name = f"{turn} turn" if rate is None else f"{turn} turn, {rate:.4g} Hz"
            place = np.broadcast_to(np.where(up == rising, at, -1), blocks[k].data.shape)
            own = rows.setdefault(name, _nowhere(blocks))
            own[k] = place
    return Places("since_turn", "s", None, np.sqrt(edges[1:] * edges[:-1]), rows)


def _by_period(axis: SignatureAxis, blocks: list[PeriodBlock]) -> Places:
    """Each period a bin; of a run that does not repeat, each of as many parts."""
    time, at, used = [], [], 0
    for block in blocks:
        parts = 1 if block.repeats else min(_BINS, block.phases)
        column = np.arange(block.phases) * parts // block.phases
        number = np.arange(block.periods)[:, None] * parts + column[None, :]
        count = block.periods * parts
        total = np.bincount(number.ravel(), minlength=count)
        time.append(np.bincount(number.ravel(), weights=block.time.ravel()) / total)
        at.append(number + used)
        used += count
    return Places(axis, "s", None, np.concatenate(time), {"": at})


def _nowhere(blocks: list[PeriodBlock]) -> list[np.ndarray]:
    return [np.full(b.data.shape, -1) for b in blocks]


def _in_run(k: int, place: np.ndarray, blocks: list[PeriodBlock]) -> list[np.ndarray]:
    out = _nowhere(blocks)
    out[k] = place
    return out
