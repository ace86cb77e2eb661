"""What a certificate of drives says: limits, proofs, straightness and what is claimed of it."""

import dataclasses
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fitting._versions import package_versions
from fitting.claim_check._thresholds import THRESHOLDS
from fitting.report.compensation._page import PART
from rapi_jax import Run, linearity, predict

from ._drive_files import file_stem
from ._unclaimed import left_out_notes, reading_nonlinearity, reading_notes, why_unclaimed

_MEANINGS = {
    "nonlinearity": "rms off a straight line, of the model's own response to the drive: what the "
    "inverse leaves. Rounding where it is 1e-12 of the span or less.",
    "nonlinearity_band": "rms off a straight line to be expected of the device (95 %), noise "
    "apart: parameters off by their standard errors, and a share of `misfit`, the rms by which the "
    "model missed runs that were left out. Wide where the recordings leave a parameter open. A "
    "`misfit` of 0 where no run was left out or noise is all that it was missed by: then of a "
    "device with exactly the model's structure.",
    "unclaimed": "why nothing is claimed of how straight the device will scan; null where "
    "`expected` is claimed.",
    "left_out": "effects of the model that were not inverted (`--without`). Readings that have "
    "them still show them: `nonlinearity_of_reading` of each drive, by the model.",
    "expected": "rms off a straight line to expect of the device in `part` of the scan, noise "
    "apart: at most `high` (97.5 %), from the errors in runs that were left out, which swung by "
    "`swings` (smallest, largest; drive unit). Of drives that swing by `swings_beside` instead it "
    "is not tested. `rapi fit --check` judges by it.",
}


def certificate_report(
    made: list[Any],
    about: dict[str, Any],
    identified: Any,
    limits: Any,
    fitted: Any,
    ecdl: Any,
    *,
    whole: Any = None,
    diagnosed: bool = False,
    folder: Path | None = None,
) -> dict[str, Any]:
    """What `certificate.json` says of the drives `made`, but for their bands and their files.

    `ecdl`: the model that was inverted; `whole`: with the effects that were left out of it, if any
    were. `diagnosed`: whether it comes from a diagnosis. `folder`: where the drives will be.
    """
    whole = ecdl if whole is None else whole
    notes, trusted, unit = [], about.get("trusted", False), about["response_unit"]
    kept = [effect.name for effect in ecdl.effects]
    left_out = list(dict.fromkeys(e.name for e in whole.effects if e.name not in kept))
    if not trusted:
        notes.append("the model was not to be trusted when it was fitted; see its model.json.")
    scans = "THIS-FOLDER" if folder is None else shlex.quote(str(folder))
    beyond = [note for one in made for note in identified.outside(one.drive)]
    notes += beyond or ([] if left_out else _beside_claim(made, about, scans))
    readings = [reading_nonlinearity(one, ecdl, whole) for one in made] if left_out else []
    notes += left_out_notes(readings, left_out, unit)
    notes += reading_notes(ecdl.effects, unit)
    unclaimed = why_unclaimed(about, left_out, diagnosed=diagnosed, beyond=bool(beyond))
    used = dataclasses.asdict(identified.limits() if limits is None else limits)
    del used["unit"]  # the report's own `drive_unit`
    report = {
        "schema": "rapi.compensation/1",
        "unit": unit,
        "drive_unit": about["drive_unit"],
        "limits": {key: value for key, value in used.items() if value < float("inf")},
        "limits_from": "identification" if limits is None else "file",
        "identified": identified.to_dict(),
        "drives": [
            one.to_dict()
            | {"file": f"{file_stem(one.drive.rate)}.csv", "nonlinearity": _nonlinearity(one, ecdl)}
            for one in made
        ],
        "claim": about.get("claim") if trusted and not left_out else None,
        "expected": _expected(about.get("claim"), made) if unclaimed is None else None,
        "unclaimed": unclaimed,
        "left_out": left_out,
        "meanings": _MEANINGS,
        "notes": list(dict.fromkeys(notes)),
        "versions": package_versions(),
        "data_sha256": about["data_sha256"],
    }
    for drive, reading in zip(report["drives"], readings, strict=bool(readings)):
        drive["nonlinearity_of_reading"] = reading
    if fitted is not None:
        report["inverse_fit"] = {
            "unit": about["drive_unit"],
            "rmse": [run.rmse for run in fitted.runs],
            "excitation_hz": [run.excitation_hz for run in fitted.runs],
        }
    return report


def _beside_claim(made: list[Any], about: dict[str, Any], folder: str) -> list[str]:
    """A note where drives swing by less or more than the runs that the fit's claim is of.

    `Identified.outside` leaves them be: thresholds that follow the swing are taken to hold there.
    """
    swings = (about.get("claim") or {}).get("swings")
    if not swings or not about.get("trusted", False):
        return []
    (low, high), unit = swings, about["drive_unit"]
    far = _swings_beside(made, swings)
    if not far:
        return []
    return [
        f"a drive swings by {_ends(min(far), max(far))} {unit}, but the fit's prediction holds for "
        f"swings of {_ends(low, high)} {unit}. Beside these a drive rests on how thresholds are "
        "taken to depend on the swing, so how far its scan reaches is not claimed: "
        f"`rapi fit NEW-SCANS --check {folder}` says what span was reached. A run with a swing "
        f"of about {np.mean(far):.2g} {unit} among those fitted would measure it."
    ]


def _swings_beside(made: list[Any], swings: Sequence[float]) -> list[float]:
    """The swings of those drives that are none of `swings`, the smallest and the largest."""
    (low, high), slack = swings, THRESHOLDS.swing_slack
    return [
        one.drive.u_pp
        for one in made
        if not low * (1.0 - slack) <= one.drive.u_pp <= high * (1.0 + slack)
    ]


def _ends(low: float, high: float) -> str:
    ends = f"{low:.3g}", f"{high:.3g}"
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _nonlinearity(one: Any, ecdl: Any) -> dict[str, float]:
    """How far off straight lines the model itself lets the scan be (rms), up and down."""
    response = np.asarray(predict(ecdl, one.drive)) if one.predicted is None else one.predicted
    up, down = linearity(Run(one.drive, response)).rms_ghz
    return {"up": up, "down": down}


def _expected(claim: dict[str, Any] | None, made: list[Any]) -> dict[str, Any] | None:
    """How far the device is to be expected off a scan like those recorded, if it can be said.

    It is the claim of the fit, less the noise. `swings`: of the runs that it is from;
    `swings_beside`: of the drives that swing by less or more.

    `low` is 0: each branch is judged about a line of its own, which takes from nothing to all of an
    error.
    """
    if claim is None:
        return None
    noise = claim["noise"]
    without = {name: max(claim[name] ** 2 - noise**2, 0.0) ** 0.5 for name in ("rms", "high")}
    swings = claim.get("swings")
    beside = sorted(_swings_beside(made, swings)) if swings else []
    return without | {
        "low": 0.0,
        "unit": claim["unit"],
        "part": PART,
        "swings": swings,
        "swings_beside": beside,
    }
