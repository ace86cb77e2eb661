"""Realised gap and linearity gain of every diagnosis that names effects, with their shares."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from fitting.blind.realised._linearity_gain import linearity_gain
from fitting.blind.realised._realised_gap import WHICH, realised_gap
from fitting.blind.simulator._bank import Spec
from fitting.blind.simulator._simulated_device import SimulatedDevice
from rapi_jax import ECDL
from rapi_jax.io import read_model

from ._outcome import Outcome
from ._thresholds import THRESHOLDS
from ._wilson import proportion

Draw = Callable[[Mapping[str, Any]], SimulatedDevice]
Progress = Callable[[str], None]


def redraw(answer: Mapping[str, Any]) -> SimulatedDevice:
    """The device of an answer, simulated again."""
    return Spec(
        seed=int(answer["seed"]),
        kind=str(answer["kind"]),
        effect=str(answer["effect"]),
        sigma=float(answer["sigma"]),
        base_misfit=bool(answer["base_misfit"]),
        any_session=bool(answer["any_session"]),
        hysteresis=str(answer["hysteresis"]),
    ).draw()


def evaluate_realised(
    entries: Sequence[Outcome], *, draw: Draw = redraw, progress: Progress | None = None
) -> dict[str, Any]:
    """Every diagnosis that names effects, evaluated on its own device.

    `unseen`: see `realised_gap`; `compensated`: see `linearity_gain`; `worlds`: one record each,
    with the error where there was one. A diagnosis that predicts nothing is not counted.
    """
    named = [entry for entry in entries if entry.names_effects]
    records = []
    for entry in named:
        if progress is not None:
            progress(f"trying {entry.name}")
        records.append(evaluate_device(entry, draw))
    return {
        "named": len(named),
        "unseen": _summarise_gap(records)
        | {"named_rightly": _summarise_gap([r for r in records if r["right"]])},
        "compensated": _summarise_linearity(records)
        | {"named_rightly": _summarise_linearity([r for r in records if r["right"]])},
        "worlds": records,
    }


def evaluate_device(entry: Outcome, draw: Draw = redraw) -> dict[str, Any]:
    """One record; an error is recorded there and does not end the check."""
    record: dict[str, Any] = {
        "name": entry.name, "verdict": entry.verdict, "right": entry.verdict == entry.correct,
        "error": None, "unseen": None, "compensated": None,
    }  # fmt: skip
    try:
        models = _models(entry.folder)
        device = draw(entry.answer)
        same = sorted(device.truth) == sorted(entry.answer["truth"])
        if not same or not np.isclose(device.size, entry.answer["size"]):
            raise ValueError(
                f"the device drawn now has {', '.join(device.truth) or 'no effect'} of size "
                f"{device.size:.3g}, which is not what its answer says. Score with the version "
                "that made the bank."
            )
        session = [run.scan for run in device.runs]
    except Exception as error:
        return record | {"error": _describe(error)}
    promised = entry.diagnosis.get("shrinkage") or {}
    for name, judge in (("unseen", realised_gap), ("compensated", linearity_gain)):
        try:
            record[name] = judge(device, session, models, promised)
        except Exception as error:
            record["error"] = f"{name}: {_describe(error)}"
    return record


def _models(folder: Path | None) -> tuple[ECDL, ECDL]:
    """With the effects named, and without."""
    if folder is None:
        raise FileNotFoundError("the prediction left no folder with models")
    model, base = (read_model(folder / name)[0] for name in ("model.rapi", "base.rapi"))
    return model, base


def _describe(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


def _summarise_gap(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    found = [r["unseen"] for r in records if r["unseen"] is not None]
    inside, no_worse, closed = {}, {}, {}
    for which in WHICH:
        ones = [f[which] for f in found]
        judged = [one for one in ones if one["inside"] is not None]
        inside[which] = proportion(
            sum(one["inside"] for one in judged), len(judged), least=THRESHOLDS.realised_target
        )
        no_worse[which] = proportion(
            sum(one["no_worse"] for one in judged), len(judged), least=THRESHOLDS.realised_target
        )
        closed[which] = {
            name: _median([one[name] for one in ones]) for name in ("closed", "closed_about_mean")
        }
    return {"inside": inside, "no_worse": no_worse, "median": closed}


def _summarise_linearity(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    found = [r for r in records if r["compensated"] is not None]
    played = [r["compensated"] for r in found if r["compensated"]["refused"] is None]
    judged = [p for p in played if p["inside"] is not None]
    return {
        # A drive that was refused helps nobody.
        "down": proportion(sum(p["down"] for p in played), len(found)),
        "inside": proportion(sum(p["inside"] for p in judged), len(judged)),
        "median_factor": _median([p["factor"] for p in played]),
        "median_ratio": _median([p["ratio"] for p in played]),
        "median_foreseen": _median([p["before"] / p["foreseen"] for p in played if p["foreseen"]]),
        "refused": [
            {"name": r["name"], "verdict": r["verdict"], "reason": r["compensated"]["refused"]}
            for r in found
            if r["compensated"]["refused"] is not None
        ],
    }


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(median(known)) if known else None
