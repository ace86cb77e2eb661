"""All predictions of a bank: made, resumed, frozen by their hashes, and verified."""

import contextlib
import hmac
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fitting.blind.protocol._folder import (
    BankFolder,
    make_folder,
    read_json,
    refuse_unknown_files,
    write_json,
)
from fitting.blind.protocol._frozen import tree_sha256
from fitting.blind.protocol._sealed import check_code, utc_now
from rapi_jax import DataError
from rapi_jax.io import OutputError, printable, read_recording

from ._predict import check_prediction_files, read_own_prediction, sha256_of
from ._workers import Job, default_workers, predict_in_workers

SCHEMA = "rapi.blind-predictions/1"
Progress = Callable[[int, int, str], None]  # done, total, last name


def predict_bank(
    folder: BankFolder,
    *,
    workers: int | None = None,
    limit: int | None = None,
    baselines: bool = True,
    progress: Progress | None = None,
) -> dict[str, int]:
    """Diagnose all recordings, or the first `limit`, that have no prediction yet.

    Returns how many there are, how many were kept, made anew, and raised. Raises `DataError` where
    predictions are closed, or those that are there were changed or come from other code.
    """
    if folder.closed.exists() or folder.scores.exists():
        used = "A sealed bank is used once" if folder.sealed else "What is closed stays as it is"
        raise DataError(
            f"{printable(folder.root)}: predictions are closed. {used}: make a new bank."
        )
    check_code(folder)
    tree = tree_sha256()
    jobs = [
        Job(str(folder.recordings / name), withheld, str(folder.predictions), tree, baselines)
        for name, withheld in folder.entries[:limit]
    ]
    names = [name for name, _ in folder.entries]
    refuse_unknown_files(folder.predictions, {*names, *(f"{name}.json" for name in names)})
    kept = run_missing(folder, jobs, workers=workers, progress=progress)
    raised = sum("error" in read_json(folder.predictions / f"{job.name}.json") for job in jobs)
    count = len(jobs)
    return {"predictions": count, "kept": kept, "new": count - kept, "raised": raised}


def run_missing(
    folder: BankFolder, jobs: list[Job], *, workers: int | None, progress: Progress | None
) -> int:
    """Run the jobs that are not done yet; return how many were done already."""
    say = progress or (lambda done, total, name: None)
    missing = [job for job in jobs if not _is_done(job)]
    kept = len(jobs) - len(missing)
    say(kept, len(jobs), "")
    if missing:
        make_folder(folder.answers, private=True)  # a run that was killed may have left it closed
        count = default_workers() if workers is None else workers
        with contextlib.closing(
            predict_in_workers(missing, folder.answers, count, compiled=folder.compiled)
        ) as names:
            for more, name in enumerate(names, 1):
                say(kept + more, len(jobs), name)
    return kept


def close_predictions(path: Path, predictions: dict[str, Path], tree: str) -> None:
    """Write the hashes of all predictions, once."""
    if path.exists():
        raise OutputError(f"{printable(path)} is there already: predictions are closed once.")
    hashes = {name: sha256_of(file) for name, file in predictions.items()}
    write_json(path, {"schema": SCHEMA, "closed": utc_now(), "tree_sha256": tree, "sha256": hashes})


def read_closed(path: Path, predictions: dict[str, Path]) -> dict[str, dict[str, Any]]:
    """All predictions, as they were closed. Raises `DataError` where one was changed."""
    promised = read_json(path).get("sha256", {})
    if set(promised) != set(predictions):
        raise DataError(
            f"{printable(path)}: not of this bank's recordings, so it was changed. Restore it."
        )
    read = {}
    for name, file in predictions.items():
        if not file.exists() or not hmac.compare_digest(sha256_of(file), promised[name]):
            raise DataError(
                f"{printable(file)}: not the prediction that was closed, so it was changed after. "
                "Restore it; nothing is scored until then."
            )
        read[name] = read_json(file)
        check_prediction_files(file, read[name])
    return read


def prediction_paths(folder: BankFolder) -> dict[str, Path]:
    """Where each recording's prediction is."""
    return {name: folder.predictions / f"{name}.json" for name, _ in folder.entries}


def _is_done(job: Job) -> bool:
    """Whether the prediction is there; refuses one that is not this job's."""
    path = Path(job.output) / f"{job.name}.json"
    if not path.exists():
        return False
    read_own_prediction(job, path, read_recording(job.recording))
    return True
