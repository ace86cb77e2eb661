"""One model fitted to each of two recordings, with the same parameters free in both."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting._parameter_words import describe_parameter
from fitting.identification._fit_many import fit_many
from fitting.identification._options import default_free
from fitting.identification._parameter_vector import ParameterVector, as_device
from fitting.identification._result import FitResult
from fitting.population.estimates._record import Record, read_record
from rapi_jax import ECDL, ModelError, Parameter, Recording
from rapi_jax.internal import follow

from ._thresholds import THRESHOLDS

Pair = tuple[ECDL, ECDL]
LABELS = ("before", "after")


@dataclasses.dataclass(frozen=True, eq=False)
class PairEstimates:
    """The fits of both recordings from `models`, and `names` of the parameters estimated in both.

    `own`: of each recording, the names of those that are of it alone: of an effect that the other
    has not (`effects_of_one`: their classes), or of the session. `notes`: parameters that are held
    in both, since one recording alone does not fix them.
    """

    models: Pair
    results: tuple[FitResult, FitResult]
    records: tuple[Record, Record]
    names: tuple[str, ...]
    own: tuple[tuple[str, ...], tuple[str, ...]]
    effects_of_one: frozenset[str]
    notes: tuple[str, ...]

    @property
    def places(self) -> tuple[list[int], list[int]]:
        """Places of `names` and of its `own` among all parameters, for each recording."""
        every = self.records[0].names
        one, two = ([every.index(name) for name in (*self.names, *own)] for own in self.own)
        return one, two

    def unit(self, name: str) -> str:
        """Of a parameter."""
        return self.records[0].units[self.records[0].names.index(name)]

    @property
    def values(self) -> tuple[np.ndarray, np.ndarray]:
        """Estimates before and after, of `names` and then of its `own`."""
        one, two = (r.values[at] for r, at in zip(self.records, self.places, strict=True))
        return one, two

    @property
    def covariances(self) -> tuple[np.ndarray, np.ndarray]:
        """Their covariances, corrected for correlated residuals."""
        one, two = (
            r.covariance[np.ix_(at, at)] for r, at in zip(self.records, self.places, strict=True)
        )
        return one, two

    @property
    def steps(self) -> tuple[np.ndarray, np.ndarray]:
        """Standard errors of differences, by which both are varied."""
        size = len(self.names)
        errors = [np.sqrt(2.0 * np.diag(covariance)) for covariance in self.covariances]
        shared = np.sqrt(0.5 * (errors[0][:size] ** 2 + errors[1][:size] ** 2))
        one, two = (np.concatenate([shared, error[size:]]) for error in errors)
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
    models: Pair,
    pair: tuple[Recording, Recording],
    without: tuple[str, ...],
    report: Callable[[str], None],
    *,
    only_in: Mapping[str, str] | None = None,
) -> PairEstimates:
    """Fits of `models`, which differ in values alone, to the recordings of a pair.

    A number that one of them does not fix, or only at a bound, or not apart from the others, is
    held in both, at what that one ended with: the other parameters then mean the same in both.
    `without`: parameters that are not compared. `only_in`: classes of effects that one recording
    alone has ("before" or "after"); in the other they stay as its model has them. Raises
    `ModelError` where no parameter is left.
    """
    owners = only_in or {}
    free = _free_in_both(models[0], pair)
    notes: list[str] = []
    for number in range(THRESHOLDS.rounds):
        report("each recording alone" if not number else "each alone, with what both fix")
        first, second = (
            fit_many(model, [one], free=_selector(free, owners, label))[0]
            for label, model, one in zip(LABELS, models, pair, strict=True)
        )
        records = read_record(first, 0), read_record(second, 1)
        held, told = _known_in_one([p for p in free if not _only_in(p.name, owners)], records)
        if not held:
            held, told = _redundant(free, records)
        notes += told
        if not held or len(held) == len(free):
            break
        models = _hold(models, free, held, owners)
        free = [p for p in free if p.name not in held]
    every, known = records[0].names, records[0].free & records[1].free
    compared = [
        i
        for i, name in enumerate(every)
        if known[i] and name not in without and not _only_in(name, owners)
    ]
    if not compared:
        raise ModelError(
            "no parameter has an estimate in both recordings, so nothing can be compared: record "
            "more than one rate or amplitude, or bring a model with fewer plays."
        )
    lost = [
        name
        for i, name in enumerate(every)
        if not known[i]
        and not (records[0].held[i] and records[1].held[i])
        and not _only_in(name, owners)
    ]
    if lost:
        notes.append(
            f"{', '.join(map(_called, lost))}: no estimate in one of the recordings or both (at a "
            "bound, or not fixed by the data), so not compared."
        )
    before, after = (
        tuple(
            name
            for i, name in enumerate(every)
            if record.free[i]
            and (_only_in(name, owners) == label or ("." in name and name in without and known[i]))
        )
        for label, record in zip(LABELS, records, strict=True)
    )
    return PairEstimates(
        models, (first, second), records, tuple(every[i] for i in compared), (before, after),
        frozenset(owners), tuple(notes),
    )  # fmt: skip


def _only_in(name: str, owners: Mapping[str, str]) -> str | None:
    """The recording whose effect a parameter is of, where the other has not that effect."""
    return owners.get(name.partition(".")[0]) if "." in name else None


def _free_in_both(ecdl: ECDL, pair: tuple[Recording, Recording]) -> list[Parameter]:
    """The parameters that a fit frees in both recordings, those of effects with them."""
    vector, out = ParameterVector.of(ecdl), []
    masks = [vector.mask(ecdl, default_free(ecdl, one)) for one in pair]
    for part, at in zip(vector.parts, vector.slices, strict=True):
        own = part.path[0] == "operator"
        if not part.held and (not own or all(mask[at].any() for mask in masks)):
            out.append(part)
    return out


def _selector(
    free: list[Parameter], owners: Mapping[str, str], label: str
) -> Callable[[ECDL], Any]:
    mine = [part for part in free if _only_in(part.name, owners) in (None, label)]
    return lambda e: tuple(follow(e, part.path) for part in mine)


def _hold(
    models: Pair, free: list[Parameter], held: Mapping[str, float], owners: Mapping[str, str]
) -> Pair:
    """The models with what is held at its value; an effect that one has not stays as it is."""
    before, after = (
        _put(
            model,
            {
                part.path: held[part.name]
                for part in free
                if part.name in held and _only_in(part.name, owners) in (None, label)
            },
        )
        for label, model in zip(LABELS, models, strict=True)
    )
    return before, after


def _put(ecdl: ECDL, held: Mapping[Any, float]) -> ECDL:
    vector = ParameterVector.of(ecdl)
    flat = vector.values(ecdl)
    for part, at in zip(vector.parts, vector.slices, strict=True):
        if part.path in held:
            flat[at] = held[part.path]
    return vector.put(ecdl, as_device(flat))


def _called(name: str) -> str:
    """A parameter in a note: that of an effect in words, one of the operator by its letter."""
    return f"{describe_parameter(name)} (`{name}`)" if "." in name else f"`{name}`"


def _in_unit(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


def _known_in_one(
    free: list[Parameter], records: tuple[Record, Record]
) -> tuple[dict[str, float], list[str]]:
    """Numbers that one recording alone fixes, at the value of the other, and notes on them."""
    held, notes = {}, []
    for part in free:
        if part.shape:
            continue
        at = records[0].names.index(part.name)
        fixed = [bool(record.free[at]) for record in records]
        if fixed[0] == fixed[1]:
            continue
        which = fixed.index(False)
        value = float(records[which].values[at])
        why = "at a bound" if records[which].at_bound[at] else "not determined by the data"
        held[part.name] = value
        amount = _in_unit(value, records[which].units[at])
        notes.append(f"{_called(part.name)} is {why} {LABELS[which]}: held at {amount} in both.")
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
        f"{_called(name)} cannot be told from the other parameters {LABELS[worst]}: held at "
        f"{_in_unit(value, record.units[at])}."
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
