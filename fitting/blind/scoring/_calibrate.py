"""Calibration of the diagnosis' probabilities on a bank whose answers are known.

The mean logarithm of the probability that the right answer was given, with each number held near
the one it starts from: a bank has few devices of each kind. Evidence is as it was predicted, so
nothing is diagnosed again.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

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
from fitting.blind.protocol._verdict_names import correct_verdict
from fitting.diagnosis.which.evidence._calibration import Calibration, load_calibration
from fitting.diagnosis.which.evidence._evidence import Evidence
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities
from rapi_jax import DataError
from rapi_jax.io import printable

from ._thresholds import THRESHOLDS

# How far a number may go (one standard deviation): of its logarithm, or as it is. A bank says
# little of when what a named effect leaves is too much.
_LOGARITHMS = {
    "temperature": 1.0,
    "form": 1.5,
    "chance": 0.7,
    "none_level": 0.5,
    "none_slope": 0.5,
    "named_excess": 0.7,
    "named_left": 0.7,
    "named_open": 0.7,
    "nonsynchronous": 0.7,
    "hysteresis": 0.7,
    "second": 0.7,
    "law": 0.7,
}
_AS_IS = {"named_level": 0.7}
# What an effect costs by chance decides on small ones, and a bank of 2 sigma and more has none: a
# fit would use it against wrong pairs, and small effects would be missed.
_HELD_ON_BANKS = ("chance",)


@dataclass(frozen=True, eq=False)
class Case:
    """Evidence of one device, and its correct verdict."""

    evidence: Evidence
    closed: dict[str, float]
    correct: str

    @classmethod
    def of(cls, answer: dict[str, Any], prediction: dict[str, Any]) -> "Case | None":
        """From an answer and a prediction; `None` where there was no diagnosis.

        And where an effect is smaller than need be seen, of a pair either: such as a law of
        thresholds with scan rate in a session of one rate. What is right to say of it is not known.
        """
        report = prediction.get("diagnosis")
        sizes = [answer["size"], *answer["alone"]] if answer["truth"] else []
        if not report or min(sizes, default=np.inf) < THRESHOLDS.detectable:
            return None
        found = {h["name"]: h.get("closed_fraction") for h in report["hypotheses"]}
        closed = {name: value["value"] for name, value in found.items() if value}
        correct = "unlisted" if prediction.get("withheld") else correct_verdict(answer["truth"])
        return cls(Evidence.from_dict(report["evidence"]), closed, correct)


def log_loss(cases: Sequence[Case], calibration: Calibration) -> float:
    """Mean of the negative logarithm of the probability of the right answer."""
    total = 0.0
    for case in cases:
        found = dict(hypothesis_probabilities(case.evidence, case.closed, calibration))
        total -= float(
            np.log(
                THRESHOLDS.fitted_least_probability
                + (1.0 - THRESHOLDS.fitted_least_probability) * found.get(case.correct, 0.0)
            )
        )
    return total / len(cases)


def fit_calibration(
    cases: Sequence[Case],
    start: Calibration,
    provenance: str,
    *,
    steps: int | None = None,
    held: Sequence[str] = (),
) -> Calibration:
    """The calibration that fits `cases` best, from `start`. Raises ValueError for no cases.

    `held`: names of numbers that stay as they are.
    """
    if not cases:
        raise ValueError("Argument `cases` must hold at least one case, but it is empty.")
    widths = {k: v for k, v in (_LOGARITHMS | _AS_IS).items() if k not in held}
    width = np.array(list(widths.values()))

    def at(x: np.ndarray) -> Calibration:
        moved = dict(zip(widths, (x * width).tolist(), strict=True))
        values = {
            k: getattr(start, k) * float(np.exp(v)) for k, v in moved.items() if k in _LOGARITHMS
        }
        values |= {k: getattr(start, k) + v for k, v in moved.items() if k in _AS_IS}
        return dataclasses.replace(start, **values, provenance=provenance)

    def cost(x: np.ndarray) -> float:
        return len(cases) * log_loss(cases, at(x)) + 0.5 * float(x @ x)

    options = {
        "maxfev": THRESHOLDS.fit_evaluations if steps is None else steps,
        "xtol": 1e-2,
        "ftol": 1e-4,
    }
    found = minimize(cost, np.zeros(width.size), method="Powell", options=options)
    return at(np.asarray(found.x))


def calibrate_to_bank(
    folder: BankFolder, *, workers: int | None = None, progress: Progress | None = None
) -> tuple[Calibration, dict[str, float]]:
    """A calibration from a bank, and the loss before and after.

    What is not predicted yet is, and predictions are closed before an answer is read. Raises
    DataError for a sealed bank: what is fitted to it can no longer be judged by it.
    """
    if folder.sealed:
        raise DataError(
            f"{printable(folder.root)}: a sealed bank is for judging alone. Calibrate on one of "
            "tier `calibration`."
        )
    if not folder.closed.exists():
        predict_bank(folder, workers=workers, baselines=False, progress=progress)
        close_predictions(folder.closed, prediction_paths(folder), tree_sha256())
    predictions = read_closed(folder.closed, prediction_paths(folder))
    found = [Case.of(value, predictions[value["name"]]) for value in reveal(folder)]
    cases = [case for case in found if case is not None]
    manifest, start = folder.manifest, load_calibration()
    provenance = (
        f"{len(cases)} devices of tier {manifest['tier']}, "
        f"seed SHA-256 {manifest['seed_sha256'][:12]}, "
        f"diagnosed by tree SHA-256 {next(iter(predictions.values()))['tree_sha256'][:12]}"
    )
    best = fit_calibration(cases, start, provenance, held=_HELD_ON_BANKS)
    return best, {"before": log_loss(cases, start), "after": log_loss(cases, best)}
