"""How far sets must be widened so that they hold the right answer as often as they say.

Split conformal prediction, see `fitting.diagnosis.which.evidence._conformal`: on devices that the
calibration's constants were not fitted to, none of which is diagnosed again.
"""

import dataclasses
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.blind.prediction._predictions import (
    Progress,
    close_predictions,
    predict_bank,
    prediction_paths,
    read_closed,
)
from fitting.blind.protocol._answers import reveal
from fitting.blind.protocol._folder import BankFolder
from fitting.blind.protocol._frozen import tree_sha256
from fitting.diagnosis.which.evidence._calibration import Calibration, load_calibration
from fitting.diagnosis.which.evidence._conformal import (
    TYPES,
    answer_type,
    conformal_factor,
    least_factor,
    temper,
    widen,
)
from rapi_jax import DataError
from rapi_jax.io import printable

from ._outcome import Outcome
from ._thresholds import THRESHOLDS

Ranked = list[tuple[str, float]]


def plain_probabilities(outcome: Outcome) -> Ranked:
    """The probabilities of a diagnosis before its set was widened, most probable first."""
    factor = float((outcome.diagnosis.get("calibration") or {}).get("widening", 1.0))
    ranked = sorted(outcome.probability.items(), key=lambda pair: -pair[1])
    return temper(ranked, 1.0 / factor)


def fit_widening(
    outcomes: Sequence[Outcome], start: Calibration, provenance: str
) -> tuple[Calibration, dict[str, Any]]:
    """The calibration with factors by type of answer, and how often sets hold the answer.

    Nulls and devices of 2 sigma or more count. A type with too few devices, or too many whose
    answer no factor reaches, takes the factor of all types together. The shares of sets are of
    factors without the device itself (leave-one-out). Raises ValueError where all are too few.
    """
    judged = [o for o in outcomes if o.is_detectable and o.error is None]
    ranked = [plain_probabilities(o) for o in judged]
    scores = np.array([least_factor(r, o.correct) for r, o in zip(ranked, judged, strict=True)])
    types = np.array([answer_type(r[0][0]) for r in ranked], dtype=object)
    factors = _factors(scores, types)
    if not factors:
        raise ValueError(
            f"Argument `outcomes` holds {len(judged)} devices to judge by, too few for sets that "
            "hold the answer in 95 %: at least 19 are needed, and most must hold it at all."
        )
    held: dict[str, list[bool]] = defaultdict(list)
    for k, name in enumerate(types):
        others = np.arange(scores.size) != k
        without = _factors(scores[others], types[others])
        held[str(name)].append(bool(scores[k] <= without.get(str(name), np.inf)))
    widened = [widen(r, factors) for r in ranked]
    confidence = np.array([r[0][1] for r in widened])
    right = np.array([r[0][0] == o.correct for r, o in zip(widened, judged, strict=True)])
    found = dataclasses.replace(
        start,
        widening=factors,
        widening_provenance=provenance,
        reliability=tuple(_reliability(confidence, right)),
    )
    return found, {
        name: {"n": len(kept), "held": sum(kept), "factor": factors[name]}
        for name, kept in sorted(held.items())
    }


def _factors(scores: np.ndarray, types: np.ndarray) -> dict[str, float]:
    """The factor of each type; empty where there are too few devices for any."""
    whole = conformal_factor(scores)
    found = {name: conformal_factor(scores[types == name]) for name in TYPES}
    out = {name: factor if np.isfinite(factor) else whole for name, factor in found.items()}
    return out if np.isfinite(list(out.values())).all() else {}


def _reliability(confidence: np.ndarray, right: np.ndarray) -> list[dict[str, Any]]:
    """How many answers were right whose probability lay between two bounds, see `Calibration`."""
    place = np.digitize(confidence, THRESHOLDS.reliability_bounds)
    parts = [place == k for k in range(len(THRESHOLDS.reliability_bounds) + 1)]
    return [
        {
            "n": int(part.sum()),
            "confidence": float(confidence[part].mean()),
            "right": float(right[part].mean()),
        }
        for part in parts
        if part.any()
    ]


def widen_to_bank(
    folder: BankFolder, *, workers: int | None = None, progress: Progress | None = None
) -> tuple[Calibration, dict[str, Any]]:
    """Factors from a bank, which the calibration's constants were not fitted to.

    What is not predicted yet is, and predictions are closed before an answer is read. Raises
    DataError for a sealed bank.
    """
    if folder.sealed:
        raise DataError(
            f"{printable(folder.root)}: a sealed bank is for judging alone. Widen sets by one of "
            "tier `open`."
        )
    if not folder.closed.exists():
        predict_bank(folder, workers=workers, baselines=False, progress=progress)
        close_predictions(folder.closed, prediction_paths(folder), tree_sha256())
    predictions = read_closed(folder.closed, prediction_paths(folder))
    outcomes = [Outcome.of(a, predictions[a["name"]]) for a in reveal(folder)]
    manifest = folder.manifest
    provenance = (
        f"{len(outcomes)} devices of tier {manifest['tier']}, "
        f"seed SHA-256 {manifest['seed_sha256'][:12]}"
    )
    return fit_widening(outcomes, load_calibration(), provenance)
