"""Estimates of recordings, drawn at the level of numbers: no signal is fitted."""

from datetime import UTC, datetime, timedelta

import numpy as np

from fitting.population.estimates._record import Record

STRUCTURE = (("operator", "RAPI"), ("plays", 10))
FIRST = datetime(2026, 1, 1, tzinfo=UTC)


def record(values, covariance, *, days=None, warm=None, label="r", **fields):
    """A record with these estimates."""
    size = len(values)
    stderr = np.sqrt(np.diag(covariance))
    scale = np.where(stderr > 0, stderr, 1.0)
    correlation = np.asarray(covariance) / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    free = dict(
        label=label,
        structure=STRUCTURE,
        names=tuple(f"x{j}" for j in range(size)),
        units=("1",) * size,
        values=np.asarray(values, dtype=np.float64),
        stderr=stderr,
        correlation=correlation,
        held=np.zeros(size, dtype=bool),
        at_bound=np.zeros(size, dtype=bool),
        bounds=np.array([[-np.inf] * size, [np.inf] * size]),
        trusted=True,
        reasons=(),
        recorded_at=None if days is None else FIRST + timedelta(days=float(days)),
        temperature_c=None if warm is None else float(warm),
        sha256=label,
    )
    return Record(**(free | fields))


def covariance(rng, size, scale):
    """A covariance with correlations, of standard deviations about `scale`."""
    half = rng.standard_normal((size, size))
    return scale**2 * (half @ half.T / size + 0.2 * np.eye(size)) * rng.uniform(0.5, 2.0)


def draw(
    rng, between, *, count, own, mean=10.0, per_day=0.0, per_kelvin=0.0, curve=None, days=None
):
    """Records of a device: `between` is its covariance between recordings, `own` errors' scale."""
    size = len(between)
    days = np.sort(rng.uniform(0.0, 365.0, count)) if days is None else np.asarray(days)
    warm = rng.normal(21.0, 1.0, count)
    out = []
    for i in range(count):
        errors = covariance(rng, size, own)
        values = rng.multivariate_normal(np.zeros(size), between) + mean
        values += rng.multivariate_normal(np.zeros(size), errors)
        values = values + np.asarray(per_day) * days[i] + np.asarray(per_kelvin) * (warm[i] - 21.0)
        if curve is not None:
            values = values + curve(days[i])
        out.append(record(values, errors, days=days[i], warm=warm[i], label=f"r{i:03d}"))
    return out


def random_between(rng, size, kind):
    """A covariance between recordings: "diagonal", "full", "factor" or "none"."""
    if kind == "none":
        return np.zeros((size, size))
    if kind == "diagonal":
        return np.diag(rng.uniform(0.5, 2.0, size) ** 2)
    if kind == "factor":
        cause = rng.standard_normal(size)
        return 0.3 * np.eye(size) + np.outer(cause, cause)
    half = rng.standard_normal((size, size))
    return half @ half.T / size + 0.1 * np.eye(size)
