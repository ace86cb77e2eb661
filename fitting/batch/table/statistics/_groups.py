"""Recordings that can be compared: results of one kind, with one set of parameters."""

import dataclasses
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
from jaxtyping import Float, Int

from fitting.batch.table._read import Result


@dataclasses.dataclass(frozen=True)
class Group:
    """Trusted results of one kind, with the parameters that vary and are known in all of them.

    `index`: of each among all recordings. `covariance`: of each recording's estimates.
    """

    kind: tuple[str, ...]
    index: Int[np.ndarray, " recordings"]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Float[np.ndarray, "recordings parameters"]
    covariance: Float[np.ndarray, "recordings parameters parameters"]

    @property
    def stderr(self) -> Float[np.ndarray, "recordings parameters"]:
        """Standard errors."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))


def make_groups(results: Sequence[Result]) -> list[Group]:
    """Groups of results that can be compared, the largest first.

    A result takes part where it is done, not called untrustworthy, and every estimate has a finite
    value and standard error. Parameters that were held, or are the same in all, are left out.
    """
    members: dict[tuple, list[int]] = {}
    for i, one in enumerate(results):
        names = tuple(name for name, e in one.row.estimates.items() if not e.held)
        known = all(
            np.isfinite([e.value, e.stderr]).all() for e in one.row.estimates.values() if not e.held
        )
        if one.done and one.trusted is not False and names and known:
            units = tuple(one.row.estimates[name].unit for name in names)
            members.setdefault((one.row.kind, names, units), []).append(i)
    groups = [
        _make_group(results, kind, names, units, index)
        for (kind, names, units), index in members.items()
    ]
    return sorted(groups, key=lambda group: -len(group.index))


def _make_group(
    results: Sequence[Result],
    kind: tuple[str, ...],
    names: tuple[str, ...],
    units: tuple[str, ...],
    index: list[int],
) -> Group:
    rows = [results[i].row for i in index]
    values = np.array([[row.estimates[name].value for name in names] for row in rows])
    stderr = np.array([[row.estimates[name].stderr for name in names] for row in rows])
    varies = np.ptp(values, axis=0) > 0 if len(index) > 1 else np.ones(len(names), dtype=bool)
    kept = [name for name, moves in zip(names, varies, strict=True) if moves]
    correlation = np.stack([_correlation(row.correlation, kept) for row in rows])
    error = stderr[:, varies]
    return Group(
        kind=kind,
        index=np.array(index),
        names=tuple(kept),
        units=tuple(unit for unit, moves in zip(units, varies, strict=True) if moves),
        values=values[:, varies],
        covariance=_positive(correlation) * error[:, :, None] * error[:, None, :],
    )


def _correlation(given: tuple[list[str], np.ndarray] | None, names: list[str]) -> np.ndarray:
    """The correlation of the named parameters; those that the file leaves out have none."""
    matrix = np.eye(len(names))
    if given is not None:
        known, full = given
        at = [(i, known.index(name)) for i, name in enumerate(names) if name in known]
        if at:
            here, there = np.array(at).T
            matrix[np.ix_(here, here)] = full[np.ix_(there, there)]
    return matrix


def _positive(matrices: np.ndarray) -> np.ndarray:
    """Each matrix without its negative eigenvalues, which rounding makes."""
    values, vectors = np.linalg.eigh((matrices + matrices.swapaxes(1, 2)) / 2.0)
    return (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.swapaxes(1, 2)


def session_time(
    results: Sequence[Result], index: Sequence[int]
) -> tuple[Float[np.ndarray, " recordings"], bool]:
    """Hours since the first of the recordings, where each names when; else their order.

    A time without a zone is taken as UTC. Returns the times, and whether they are hours.
    """
    found = []
    for i in index:
        text = results[i].row.figures.get("recorded_at")
        try:
            moment = datetime.fromisoformat(str(text))
        except ValueError:
            return np.asarray(index, dtype=float), False
        found.append((moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp())
    hours = (np.array(found) - min(found, default=0.0)) / 3600.0
    return hours, True
