"""Calibration of the probabilities: reliability diagram, calibration errors, proper scores.

A diagnosis that failed is a forecast that was certain and wrong.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._outcome import Outcome
from ._thresholds import THRESHOLDS
from ._wilson import compare_with_target

Array = npt.NDArray[np.float64]


def calibration_scores(entries: Sequence[Outcome], *, seed: int = 0) -> dict[str, Any]:
    """Calibration errors with 95 % intervals, and both scores beside those of the base rate."""
    confidence = np.array([e.confidence for e in entries], dtype=float)
    right = np.array([e.verdict == e.correct for e in entries], dtype=float)
    mass, width = (
        _with_interval(confidence, right, equal_mass, seed) for equal_mass in (True, False)
    )
    scores = _proper_scores(entries)
    return {
        "ece_equal_mass": compare_with_target(
            mass["value"], len(entries), most=THRESHOLDS.calibration_target
        )
        | mass,
        "ece_equal_width": compare_with_target(
            width["value"], len(entries), most=THRESHOLDS.calibration_target
        )
        | width,
        "reliability": reliability_diagram(confidence, right),
        **scores,
    }


def calibration_error(confidence: Array, right: Array, *, equal_mass: bool) -> float:
    """Mean over bins of |share right - mean confidence|, weighted by how many each bin holds."""
    total = 0.0
    for part in _bins(confidence, equal_mass):
        if part.size:
            total += part.size * abs(float(right[part].mean() - confidence[part].mean()))
    return total / max(confidence.size, 1)


def reliability_diagram(confidence: Array, right: Array) -> list[dict[str, Any]]:
    """The curve itself, in bins of equal mass: mean confidence, share right, and how many."""
    return [
        {
            "n": int(part.size),
            "confidence": float(confidence[part].mean()),
            "right": float(right[part].mean()),
        }
        for part in _bins(confidence, True)
        if part.size
    ]


def _bins(confidence: Array, equal_mass: bool) -> list[npt.NDArray[np.intp]]:
    if equal_mass:
        return list(np.array_split(np.argsort(confidence, kind="stable"), THRESHOLDS.bins))
    place = np.minimum((confidence * THRESHOLDS.bins).astype(int), THRESHOLDS.bins - 1)
    return [np.flatnonzero(place == k) for k in range(THRESHOLDS.bins)]


def _with_interval(confidence: Array, right: Array, equal_mass: bool, seed: int) -> dict[str, Any]:
    """The error, its bootstrap interval, and what chance alone gives a calibrated forecaster."""
    if not confidence.size:
        return {"value": None, "low": None, "high": None, "by_chance": None}
    rng = np.random.default_rng(seed)
    again, honest = [], []
    for _ in range(THRESHOLDS.bootstrap_draws):
        pick = rng.integers(confidence.size, size=confidence.size)
        again.append(calibration_error(confidence[pick], right[pick], equal_mass=equal_mass))
        drawn = (rng.random(confidence.size) < confidence).astype(float)
        honest.append(calibration_error(confidence, drawn, equal_mass=equal_mass))
    low, high = np.quantile(again, [0.025, 0.975])
    return {
        "value": calibration_error(confidence, right, equal_mass=equal_mass),
        "low": float(low),
        "high": float(high),
        "by_chance": float(np.mean(honest)),
    }


def _proper_scores(entries: Sequence[Outcome]) -> dict[str, Any]:
    """Brier and log score over all hypotheses; less is better.

    The base rate is that of this very bank, known exactly: the best that a forecaster
    could do who looks at no recording.
    """
    seen = Counter(e.correct for e in entries)
    rate = {name: count / len(entries) for name, count in seen.items()}
    mine = [_brier_and_log(e.probability, e.correct) for e in entries]
    base = [_brier_and_log(rate, e.correct) for e in entries]
    out = {}
    for k, name in enumerate(("brier", "log")):
        own, other = _mean([m[k] for m in mine]), _mean([b[k] for b in base])
        better = None if own is None or other is None else own < other
        out[name] = {"n": len(entries), "value": own, "base_rate": other, "met": better}
    return out


def _brier_and_log(probability: Any, right: str) -> tuple[float, float]:
    names = set(probability) | {right}
    brier = sum((probability.get(name, 0.0) - (name == right)) ** 2 for name in names)
    return float(brier), float(
        -np.log(max(probability.get(right, 0.0), THRESHOLDS.least_probability))
    )


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None
