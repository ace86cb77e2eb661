"""Estimates of all recordings as arrays, in standardised coordinates."""

import collections
import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from fitting.population._thresholds import THRESHOLDS
from rapi_jax import DataError, ModelError

from ._record import Record

LEFT_OUT = ("d_0",)


@dataclasses.dataclass(frozen=True, eq=False)
class Estimates:
    """What each recording's own fit says of the parameters `names`, divided by `scale`.

    `known`: where there is an estimate; elsewhere `values` and `covariances` are 0.
    """

    records: tuple[Record, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    scale: Float[np.ndarray, " parameters"]
    values: Float[np.ndarray, "recordings parameters"]
    covariances: Float[np.ndarray, "recordings parameters parameters"]
    known: Bool[np.ndarray, "recordings parameters"]

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.names)

    def only(self, j: int) -> "Estimates":
        """Those of one parameter."""
        at = slice(j, j + 1)
        return dataclasses.replace(
            self, names=self.names[at], units=self.units[at], scale=self.scale[at],
            values=self.values[:, at], covariances=self.covariances[:, at, at],
            known=self.known[:, at],
        )  # fmt: skip

    def of(self, record: Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values, covariance and known of another recording, in the same coordinates."""
        check_alike([*self.records[:1], record])
        at = [record.names.index(name) for name in self.names]
        _check_held([*self.records[:1], record], self.names)
        free = record.free[at]
        values = np.where(free, record.values[at] / self.scale, 0.0)
        covariance = record.covariance[np.ix_(at, at)] / np.outer(self.scale, self.scale)
        return values, covariance, free


def gather(records: Sequence[Record], without: Sequence[str], most: int) -> tuple[Estimates, list]:
    """The estimates of `records`, and notes on parameters that are no part of them.

    `without`: parameters that are left out. `most`: fixed effects a parameter; one with fewer
    estimates than these and the least degrees of freedom is left out. Raises `DataError` where
    recordings were not fitted alike, `ModelError` where no parameter is left.
    """
    check_alike(records)
    first = records[0]
    unknown = [name for name in without if name not in first.names and name not in LEFT_OUT]
    if unknown:
        raise ModelError(
            f"no parameter `{unknown[0]}` to leave out; there are {', '.join(first.names)}."
        )
    free = np.stack([record.free for record in records])
    need = most + THRESHOLDS.least_degrees
    counts = free.sum(axis=0)
    at = [i for i, name in enumerate(first.names) if counts[i] >= need and name not in without]
    if not at:
        raise ModelError(
            f"no parameter has an estimate in {need} recordings or more, which is the least for "
            f"{most} coefficient(s) a parameter and a scatter. Record more, or fit fewer plays."
        )
    names = tuple(first.names[i] for i in at)
    _check_held(records, names)
    notes = _note_missing(records, free, at, without, need)
    values = np.stack([record.values for record in records])[:, at]
    covariances = np.stack([record.covariance for record in records])[:, at][:, :, at]
    known = free[:, at]
    scale = np.array(
        [
            np.sqrt(np.var(values[k, j]) + np.median(covariances[k, j, j]))
            for j, k in enumerate(known.T)
        ]
    )
    estimates = Estimates(
        tuple(records), names, tuple(first.units[i] for i in at), scale,
        np.where(known, values / scale, 0.0), covariances / np.outer(scale, scale), known,
    )  # fmt: skip
    return estimates, notes


def check_alike(records: Sequence[Record]) -> None:
    """Raise `DataError` where two fits have other parameters, or are of the same recording."""
    first = records[0]
    for record in records[1:]:
        for (name, mine), (_, theirs) in zip(first.structure, record.structure, strict=True):
            if mine != theirs:
                raise DataError(
                    f"{record.label}: {name} {theirs}, but {first.label} has {mine}. Only fits of "
                    "one structure have the same parameters: fit all recordings alike."
                )
        if (record.names, record.units) != (first.names, first.units):
            other = sorted(set(record.names) ^ set(first.names)) or ["units"]
            raise DataError(
                f"{record.label}: its parameters are not those of {first.label} (`{other[0]}`, and "
                f"{len(other) - 1} more). Fit all recordings alike, such as with `--each none`."
            )
    shared = [sha for sha, n in collections.Counter(r.sha256 for r in records).items() if n > 1]
    if shared:
        one, two, *_ = [r.label for r in records if r.sha256 == shared[0]]
        raise DataError(
            f"{two}: of the same recording as {one}. Each recording counts once: leave one out."
        )


def _check_held(records: Sequence[Record], names: Sequence[str]) -> None:
    """Values that no recording frees must be the same: the others are counted from them."""
    first = records[0]
    for i, name in enumerate(first.names):
        if name in names or not all(record.held[i] for record in records):
            continue
        held = np.array([record.values[i] for record in records])
        far = np.abs(held - held[0]) > THRESHOLDS.same_held * (np.abs(held) + np.abs(held[0]))
        if far.any():
            at = int(np.argmax(far))
            raise DataError(
                f"{records[at].label}: `{name}` was held at {held[at]:.6g}, but in {first.label} "
                f"at {held[0]:.6g}: the other parameters do not mean the same. Fit all recordings "
                "from one model, as `fit_many` does."
            )


def _note_missing(
    records: Sequence[Record],
    free: np.ndarray,
    at: Sequence[int],
    without: Sequence[str],
    need: int,
) -> list[str]:
    notes = []
    first, count = records[0], len(records)
    for i, name in enumerate(first.names):
        have = int(free[:, i].sum())
        if i in at and have < count:
            bound = sum(bool(record.at_bound[i]) for record in records)
            notes.append(
                f"`{name}` has no estimate in {count - have} of {count} recordings (held, not "
                f"fixed by the data, or at a bound: {bound}); those say nothing of it."
            )
        elif i not in at and 0 < have < need and name not in without:
            notes.append(f"`{name}` is left out: only {have} recording(s) have an estimate of it.")
    return notes
