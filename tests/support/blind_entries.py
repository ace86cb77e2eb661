"""Hand-made answers and predictions, and lasers that are one of our own models."""

import dataclasses
from typing import Any

from fitting.blind.realised._model_response import model_response
from fitting.blind.simulator._scan import Scan, place_in_time


def answer(name: str, kind: str, *truth: str, size: float = 10.0, misfit: bool = False) -> dict:
    return {
        "name": name, "seed": 1, "kind": kind, "effect": "", "sigma": size, "base_misfit": misfit,
        "truth": list(truth), "asked": size, "size": size, "alone": [], "parameters": {},
        "noise_ghz": 0.02,
    }  # fmt: skip


def prediction(
    said: str,
    *names: str,
    sure: float = 1.0,
    other: str = "none",
    survival: float | None = None,
    closed: float | None = None,
    withheld: str | None = None,
    seconds: float = 20.0,
    **baselines: str,
) -> dict[str, Any]:
    """`said` with probability `sure`, the rest on `other`; the set is `names`, or `said` alone."""
    effects = [] if said in ("none", "unlisted") else said.split("+")
    hypotheses: list[dict[str, Any]] = [{"name": said, "probability": sure}]
    if sure < 1.0:
        hypotheses.append({"name": other, "probability": 1.0 - sure})
    if survival is not None:
        hypotheses[0]["survival"] = survival
    interval = None if closed is None else {"value": closed, "low": closed - 0.1, "high": 1.0}
    return {
        "schema": "rapi.blind-prediction/1",
        "name": "",
        "withheld": withheld,
        "diagnosis": {
            "verdict": {"name": said, "effects": effects, "set": list(names or (said,))},
            "hypotheses": hypotheses,
            "shrinkage": {
                "closed_fraction": interval,
                "foreseen": interval,
                "straighter": None,
            },  # fmt: skip
            "seconds": seconds,
        },
        "baselines": baselines,
    }


FAILED = {"schema": "rapi.blind-prediction/1", "name": "", "withheld": None, "error": "Odd: x"}


def session() -> tuple[Scan, ...]:
    """Four runs at three rates and two swings."""
    rows = [(10.0, 4.5), (20.0, 4.5), (40.0, 4.5), (20.0, 2.5)]
    scans = [Scan(rate, swing, 3.0, "triangle", 3, 200) for rate, swing in rows]
    return place_in_time(scans, 1.0)


@dataclasses.dataclass(frozen=True)
class OurLaser:
    """A laser that is exactly one of our models."""

    ecdl: Any

    def simulate(self, scans: Any) -> list:
        return model_response(self.ecdl, scans)
