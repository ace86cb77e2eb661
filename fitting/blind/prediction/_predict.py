"""One blind prediction: a diagnosis, the baselines beside it, and the models for later checks."""

import hashlib
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting.blind.protocol._folder import make_folder, read_json, write_json
from rapi_jax import DataError, Recording, effects
from rapi_jax.io import printable, read_recording, write_drive, write_model

if TYPE_CHECKING:
    from fitting.diagnosis import Diagnosis

    from ._workers import Job

SCHEMA = "rapi.blind-prediction/1"
MODEL, BASE, NEXT = "model.rapi", "base.rapi", "next_drive.csv"


def predict_one(job: "Job", refused: Sequence[str] = ()) -> None:
    """Diagnose a recording and write its prediction; a diagnosis that raises counts as wrong.

    The prediction is written last, and holds the hashes of the files beside it. `refused`: what the
    blindfold has refused so far.
    """
    began = time.perf_counter()
    recording = read_recording(job.recording)
    output = make_folder(Path(job.output))
    before = len(refused)
    prediction: dict[str, Any] = {
        "schema": SCHEMA,
        "name": job.name,
        "withheld": job.withheld,
        "recording_sha256": recording.sha256(),
        "tree_sha256": job.tree_sha256,
        "baselines": {},
        "files": {},
    }
    candidates = allowed_effects(job.withheld)
    try:
        report = _diagnose(recording, candidates, job.scan)
    except MemoryError:
        raise  # of this machine, and no answer
    except Exception as error:
        prediction["error"] = _describe(error)
    else:
        prediction["diagnosis"] = {k: v for k, v in report.to_dict().items() if k != "maps"}
        prediction["files"] = _write_files(report, output / job.name)
    prediction["seconds"] = time.perf_counter() - began
    if job.baselines:
        try:
            prediction["baselines"] = _baselines(recording, candidates)
        except MemoryError:
            raise
        except Exception as error:
            prediction["baselines_error"] = _describe(error)
    prediction["refused"] = list(refused[before:])
    write_json(output / f"{job.name}.json", prediction)


def allowed_effects(withheld: str | None) -> tuple[type[effects.AbstractEffect], ...]:
    """The effects that a diagnosis may name."""
    names = [effect.name for effect in effects.ALL]
    if withheld is not None and withheld not in names:
        raise DataError(
            f"the effect {printable(withheld)} cannot be withheld: there are {', '.join(names)}."
        )
    return tuple(effect for effect in effects.ALL if effect.name != withheld)


def recording_seed(recording: Recording) -> int:
    """A seed from the content of the recording: reproducible, and chosen by nobody."""
    return int(recording.sha256()[:8], 16)


def read_own_prediction(job: "Job", path: Path, recording: Recording) -> dict[str, Any]:
    """The prediction in `path`. Raises `DataError` where it is not of this job, or was changed."""
    prediction = read_json(path)
    wanted = {
        "schema": SCHEMA,
        "name": job.name,
        "withheld": job.withheld,
        "recording_sha256": recording.sha256(),
        "tree_sha256": job.tree_sha256,
    }
    for key, value in wanted.items():
        if prediction.get(key) != value:
            raise DataError(
                f"{printable(path)}: `{key}` is not this recording's and this version's, so the "
                "prediction is of other code, or was changed. Remove the predictions to begin anew."
            )
    check_prediction_files(path, prediction)
    return prediction


def check_prediction_files(path: Path, prediction: dict[str, Any]) -> None:
    """Raise `DataError` where a model beside the prediction is not the one it was written with."""
    for name, promised in prediction["files"].items():
        file = path.with_suffix("") / name
        if not file.exists() or sha256_of(file) != promised:
            raise DataError(
                f"{printable(file)}: not the file that was written with the prediction. Restore "
                "it, or remove the prediction to make both anew."
            )


def sha256_of(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _diagnose(
    recording: Recording, candidates: tuple[type[effects.AbstractEffect], ...], scan: bool
) -> "Diagnosis":
    from fitting.diagnosis import diagnose

    return diagnose(None, recording, candidates=candidates, scan=scan)


def _baselines(
    recording: Recording, candidates: tuple[type[effects.AbstractEffect], ...]
) -> dict[str, str]:
    from ._baselines import baseline_verdicts

    return baseline_verdicts(recording, candidates, seed=recording_seed(recording))


def _describe(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _write_files(report: "Diagnosis", folder: Path) -> dict[str, str]:
    """Write models and next scan; give the hash of each."""
    from rapi_jax import Identified

    make_folder(folder)
    recording = report.recording
    for name, model in ((MODEL, report.model), (BASE, report.base)):
        write_model(
            folder / name,
            model,
            response_unit=recording.response_unit,
            drive_unit=recording.drive_unit,
            response_origin=recording.response_origin,
            response_lag_s=recording.response_lag_s,
            trusted=report.verdict.name != "unlisted",
            identified=Identified.of(recording).to_dict(),
            data_sha256=recording.sha256(),
        )
    if report.next_drive is not None:
        write_drive(report.next_drive, folder / NEXT)
    written = sorted(path for path in folder.iterdir() if path.name in (MODEL, BASE, NEXT))
    return {path.name: sha256_of(path) for path in written}
