"""One model fitted to each of two recordings, with the same parameters free in both."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.identification._fit_many import fit_many
from fitting.identification._options import default_free
from fitting.identification._parameter_vector import ParameterVector, as_device
from fitting.identification._result import FitResult
from fitting.population.estimates._record import Record, read_record
from rapi_jax import ECDL, ModelError, Parameter, Recording
from rapi_jax.internal import follow

from ._thresholds import THRESHOLDS

Pair = tuple[Recording, Recording]
_LABELS = ("before", "after")


@dataclasses.dataclass(frozen=True, eq=False)
class PairEstimates:
    """The fits of both recordings from `model`, and `names` of the parameters estimated in both.

    `notes`: parameters that are held in both, since one recording alone does not fix them.
    """

    model: ECDL
    results: tuple[FitResult, FitResult]
    records: tuple[Record, Record]
    names: tuple[str, ...]
    units: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def places(self) -> list[int]:
        """Places of `names` among all parameters."""
        return [self.records[0].names.index(name) for name in self.names]

    @property
    def values(self) -> tuple[np.ndarray, np.ndarray]:
        """Estimates before and after."""
        one, two = (record.values[self.places] for record in self.records)
        return one, two

    @property
    def covariances(self) -> tuple[np.ndarray, np.ndarray]:
        """Their covariances, corrected for correlated residuals."""
        pick = np.ix_(self.places, self.places)
        one, two = (record.covariance[pick] for record in self.records)
        return one, two

    @property
    def degrees(self) -> float:
        """Degrees of freedom of the noise: independent samples less parameters, of both."""
        samples = sum(result.effective - record.free.sum() for result, record in self._both)
        return float(max(samples, 1.0))

    @property
    def _both(self) -> list[tuple[FitResult, Record]]:
        return list(zip(self.results, self.records, strict=True))


def estimate_pair(
    ecdl: ECDL,
    pair: Pair,
    without: tuple[str, ...],
    report: Callable[[str], None],
    *,
    only_in: Mapping[str, str] | None = None,
) -> PairEstimates:
    """Fits of `ecdl` to both recordings, less the parameters `without` among `names`.

    A number that one of them does not fix, or only at a bound, or not apart from the others, is
    held in both, at what that one ended with: the other parameters then mean the same in both.
    `only_in`: classes of effects that one recording alone has ("before" or "after"), which says
    what is held of theirs. Raises `ModelError` where no parameter is left.
    """
    free = _free_in_both(ecdl, pair)
    notes: list[str] = []
    for number in range(THRESHOLDS.rounds):
        report("each recording alone" if not number else "each alone, with what both fix")
        first, second = fit_many(ecdl, list(pair), free=_selector(free))
        records = read_record(first, 0), read_record(second, 1)
        held, told = _known_in_one(free, records, only_in or {})
        if not held:
            held, told = _redundant(free, records)
        notes += told
        if not held or len(held) == len(free):
            break
        by_name = {p.name: p for p in free}
        paths = [by_name[name].path for name in held]
        ecdl = _put(ecdl, paths, list(held.values()))
        free = [p for p in free if p.name not in held]
    known = records[0].free & records[1].free
    at = [i for i, name in enumerate(records[0].names) if known[i] and name not in without]
    if not at:
        raise ModelError(
            "no parameter has an estimate in both recordings, so nothing can be compared: record "
            "more than one rate or amplitude, or bring a model with fewer plays."
        )
    every = records[0].names
    lost = [
        name
        for i, name in enumerate(every)
        if not known[i] and not (records[0].held[i] and records[1].held[i])
    ]
    if lost:
        notes.append(
            f"{', '.join(lost)}: no estimate in one of the recordings or both (at a bound, or not "
            "fixed by the data), so not compared."
        )
    return PairEstimates(
        ecdl, (first, second), records,
        tuple(every[i] for i in at), tuple(records[0].units[i] for i in at), tuple(notes),
    )  # fmt: skip


def _free_in_both(ecdl: ECDL, pair: Pair) -> list[Parameter]:
    """The parameters that a fit frees in both recordings, those of effects with them."""
    vector, out = ParameterVector.of(ecdl), []
    masks = [vector.mask(ecdl, default_free(ecdl, one)) for one in pair]
    for part, at in zip(vector.parts, vector.slices, strict=True):
        own = part.path[0] == "operator"
        if not part.held and (not own or all(mask[at].any() for mask in masks)):
            out.append(part)
    return out


def _selector(free: list[Parameter]) -> Callable[[ECDL], Any]:
    return lambda e: tuple(follow(e, part.path) for part in free)


def _put(ecdl: ECDL, paths: list[Any], values: list[float]) -> ECDL:
    vector = ParameterVector.of(ecdl)
    flat = vector.values(ecdl)
    for path, value in zip(paths, values, strict=True):
        at = next(s for p, s in zip(vector.parts, vector.slices, strict=True) if p.path == path)
        flat[at] = value
    return vector.put(ecdl, as_device(flat))


def _known_in_one(
    free: list[Parameter], records: tuple[Record, Record], only_in: Mapping[str, str]
) -> tuple[dict[str, float], list[str]]:
    """Numbers that one recording alone fixes, at the value of the other, and notes on them.

    Those of an effect that one recording alone has are held at what it has there: the other has
    none of it, and where its fit ended along what it lacks says nothing.
    """
    held, notes = {}, []
    for part in free:
        if part.shape:
            continue
        at = records[0].names.index(part.name)
        fixed = [bool(record.free[at]) for record in records]
        if fixed[0] == fixed[1]:
            continue
        which = fixed.index(False)
        owner = part.name.partition(".")[0]
        source = _LABELS.index(only_in[owner]) if owner in only_in else which
        value = float(records[source].values[at])
        why = "at a bound" if records[which].at_bound[at] else "not determined by the data"
        held[part.name] = value
        notes.append(f"`{part.name}` is {why} {_LABELS[which]}: held at {value:.4g} in both.")
    return held, notes


def _redundant(
    free: list[Parameter], records: tuple[Record, Record]
) -> tuple[dict[str, float], list[str]]:
    """The number that one recording tells least from all others, at its value there, and a note.

    Its error is that of the others together, far beyond what a model is linear over; with it held,
    they are known.
    """
    inflations = [_inflations(record) for record in records]
    worst = 0 if inflations[0].max(initial=0.0) > inflations[1].max(initial=0.0) else 1
    at = int(np.argmax(inflations[worst]))
    record, name = records[worst], records[worst].names[at]
    if inflations[worst][at] < THRESHOLDS.redundant or name not in {p.name for p in free}:
        return {}, []
    value = float(record.values[at])
    note = (
        f"`{name}` cannot be told from the other parameters {_LABELS[worst]}: held at {value:.4g} "
        "in both."
    )
    return {name: value}, [note]


def _inflations(record: Record) -> Float[np.ndarray, " parameters"]:
    """Standard error of each number, over what it would be were all others known.

    The root of the variance inflation factor (D. W. Marquardt, Technometrics 12, 591, 1970).
    """
    out, free = np.zeros(record.values.size), np.flatnonzero(record.free)
    size, axes = np.linalg.eigh(record.correlation[np.ix_(free, free)])
    least = np.finfo(np.float64).eps * free.size
    out[free] = np.sqrt((axes**2 / np.maximum(size, least)).sum(axis=1))
    return out
