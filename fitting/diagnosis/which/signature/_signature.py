"""The signature of a named effect beside the data: mean errors without it and with it.

Over the axis on which the effect is regular, see `AbstractEffect.signature_axis`: an etalon repeats
with the response, a lag decays with the time since the drive turned. What the errors without the
effect share with those with it is not the effect's.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.where._residual_profiles import remove_origin, to_numbers
from rapi_jax import Recording
from rapi_jax.effects import AbstractEffect

from ._signature_axis import Places, place_samples

Errors = list[Float[np.ndarray, "_ _"]]


def describe_signatures(
    effects: tuple[AbstractEffect, ...],
    without: Sequence[Errors],
    with_effects: Errors,
    blocks: list[PeriodBlock],
    recording: Recording,
    *,
    own_origin: bool = False,
) -> list[dict[str, Any]]:
    """One signature for each of `effects`; of several that show alike, the first.

    **Arguments:**

    - `without`, `with_effects`: errors ("periods phases" a run, model less data) of a refit without
      each of `effects`, but with the others, and of the one with all of them.
    - `own_origin`: the runs have a zero each. It is left out, as that of all runs is elsewhere.

    **Returns** for each its `axis` (see `AbstractEffect.signature_axis`), the unit of `x`, the
    `period` by which `x` was folded, or null, and `rows`: at each `x` the mean of data less model
    `without` and `with` the effects, the standard error of the latter from its scatter, and how
    many `readings` there are. On the axis `gain` these are shares of the response, else in its
    unit. `rms_without`, `rms_with`: over all means, each counted as often as it has readings, so
    that none exceeds the rms of the errors.
    """
    model = [_predict(e, b) for e, b in zip(with_effects, blocks, strict=True)]
    lacking = [remove_origin(errors, blocks, own_origin=own_origin) for errors in without]
    with_effects = remove_origin(with_effects, blocks, own_origin=own_origin)
    out: list[dict[str, Any]] = []
    seen: set[tuple[str, float | None]] = set()
    for effect, errors in zip(effects, lacking, strict=True):
        found = place_samples(effect, model, blocks, recording)
        if (found.axis, found.period) in seen:
            continue
        seen.add((found.axis, found.period))
        rows = [
            {"row": name} | _means(found, at, errors, with_effects, model, blocks)
            for name, at in found.rows.items()
        ]
        out.append(
            {
                "effect": effect.name,
                "axis": found.axis,
                "unit": found.unit,
                "period": found.period,
                "rows": rows,
                "rms_without": _rms(rows, "without"),
                "rms_with": _rms(rows, "with"),
            }
        )
    return out


def _means(
    found: Places,
    place: list[Int[np.ndarray, "_ _"]],
    without: Errors,
    with_effects: Errors,
    model: Errors,
    blocks: list[PeriodBlock],
) -> dict[str, list[float | None]]:
    """Means in the bins of one row; `None` for a bin without a reading."""
    where = np.concatenate([p.ravel() for p in place])
    use = np.concatenate([b.use.ravel() for b in blocks]) > 0
    inside = use & (where >= 0)
    bins = found.x.size
    at = where[inside]
    weight = np.ones(at.size)
    if found.axis == "gain":  # the slope of the errors by the response, instead of their mean
        response = np.concatenate([m.ravel() for m in model])[inside]
        count = np.maximum(np.bincount(at, minlength=bins), 1)
        weight = response - (np.bincount(at, weights=response, minlength=bins) / count)[at]
    size = np.bincount(at, weights=weight**2, minlength=bins)
    some = size > 0

    def mean(errors: Errors) -> np.ndarray:
        values = -np.concatenate([e.ravel() for e in errors])[inside]
        total = np.bincount(at, weights=values * weight, minlength=bins)
        return np.where(some, total / np.where(some, size, 1.0), np.nan)

    left = mean(with_effects)
    rest = -np.concatenate([e.ravel() for e in with_effects])[inside] - left[at] * weight
    count = np.bincount(at, minlength=bins)
    square = np.bincount(at, weights=rest**2, minlength=bins) / np.maximum(count - 1, 1)
    stderr = np.where(count > 1, np.sqrt(square / np.where(some, size, 1.0)), np.nan)
    columns = (found.x, mean(without), left, stderr, count)
    return {
        key: to_numbers(column[some])
        for key, column in zip(("x", "without", "with", "stderr", "readings"), columns, strict=True)
    }


def _predict(error: np.ndarray, block: PeriodBlock) -> np.ndarray:
    """The model's response; where no reading is in use, that of the first that is."""
    used = block.use > 0
    value = error + np.where(used, block.data, 0.0)
    return np.where(used, value, value[used][0] if used.any() else 0.0)


def _rms(rows: list[dict[str, Any]], key: str) -> float:
    pairs = [(v, n) for row in rows for v, n in zip(row[key], row["readings"], strict=True)]
    square = sum(n * v * v for v, n in pairs if v is not None)
    return math.sqrt(square / max(sum(n for v, n in pairs if v is not None), 1.0))
