"""Scoring a bank: predict what is missing, freeze, reveal, measure again, score."""

import csv
import io
from pathlib import Path
from typing import Any

from fitting.blind.prediction import _follow_up as _follow
from fitting.blind.prediction._predictions import (
    Progress,
    close_predictions,
    predict_bank,
    prediction_paths,
    read_closed,
)
from fitting.blind.protocol._answers import read_spec, reveal
from fitting.blind.protocol._folder import BankFolder, make_folder, write_json
from fitting.blind.protocol._frozen import tree_sha256
from fitting.blind.protocol._sealed import check_sealed_specs, read_secret
from rapi_jax import DataError
from rapi_jax.io import printable, write_atomic

SCHEMA = "rapi.blind-scores/1"
SCORES, TABLE, FAILURES = "scores.json", "scores.md", "failures.csv"


def score_bank(
    folder: BankFolder,
    *,
    follow: int | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Score the bank, and write `scores.json`, `scores.md` and `failures.csv`.

    `follow`: how many ambiguous devices are measured again (once), see `_follow_up`.

    Nothing of the answers is read before predictions are closed; nothing is scored where an answer,
    a salt, a recording, a prediction or a model is not the one that was committed to. Raises
    `DataError` in that case.
    """
    found = prediction_paths(folder)
    if not folder.closed.exists():
        predict_bank(folder, workers=workers, progress=progress)
        close_predictions(folder.closed, found, tree_sha256())
    predictions = read_closed(folder.closed, found)
    make_folder(folder.answers, private=True)  # a run that was killed may have left it closed
    answers = reveal(folder)
    secret = _secret(folder, answers)
    for value in answers:
        _check_recording(folder, value, predictions[value["name"]])
    pairs, second = _second(folder, predictions, follow, workers, progress)
    by_name = {value["name"]: value for value in answers}
    entries = [(v, predictions[v["name"]], folder.predictions / v["name"]) for v in answers]
    again = []
    for pair in pairs:
        after = [second[key] for key in _follow.files_by_key([pair])]
        again.append((by_name[pair.name], predictions[pair.name], *after))
    scored = _scored(entries, again, progress)
    manifest = folder.manifest
    kept = ("tier", "count", "seed_sha256", "tree_sha256", "secret_sha256")
    scores = {
        **scored,
        "schema": SCHEMA,
        "bank": {key: manifest[key] for key in kept},
        "secret": secret.hex(),
    }
    from .tables._table import markdown

    write_atomic(folder.root / FAILURES, _csv(scores.get("failures", [])))
    write_atomic(folder.root / TABLE, markdown(scores))
    write_json(folder.scores, scores)
    return scores


def _secret(folder: BankFolder, answers: list[dict[str, Any]]) -> bytes:
    """The secret; of a sealed bank it must give the devices that are there."""
    if folder.sealed:
        return check_sealed_specs(folder, [read_spec(value) for value in answers])
    return read_secret(folder)


def _check_recording(folder: BankFolder, value: dict[str, Any], prediction: dict[str, Any]) -> None:
    if prediction.get("recording_sha256") != value["recording_sha256"]:
        raise DataError(
            f"{printable(folder.recordings / value['name'])}: not the recording that the answer "
            "was committed with. Nothing can be scored."
        )


def _second(
    folder: BankFolder,
    predictions: dict[str, dict[str, Any]],
    most: int | None,
    workers: int | None,
    progress: Progress | None,
) -> tuple[list[_follow.FollowUp], dict[str, dict[str, Any]]]:
    """Second sessions; none any more where other code closed the first predictions."""
    closed = folder.follow / _follow.CLOSED
    if not closed.exists():
        if any(p["tree_sha256"] != tree_sha256() for p in predictions.values()):
            return [], {}
        _follow.follow_up(folder, predictions, most=most, workers=workers, progress=progress)
    pairs = _follow.closed_follow_ups(folder, predictions)
    return pairs, read_closed(closed, _follow.files_by_key(pairs))


def _scored(
    entries: list[tuple[dict[str, Any], dict[str, Any], Path]],
    follow: list[tuple[Any, ...]],
    progress: Progress | None,
) -> dict[str, Any]:
    from ._scores import score

    say = progress or (lambda done, total, name: None)
    total = len(entries)
    return score(
        entries,
        draw=lambda value: read_spec(value).draw(),
        follow=follow,
        progress=lambda line: say(total, total, line),
    )


def _csv(rows: list[dict[str, Any]]) -> str:
    """Failures as a table: lists joined by blanks."""
    columns = list(dict.fromkeys(key for row in rows for key in row)) or ["name"]
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        cells = {k: " ".join(map(str, v)) if isinstance(v, list) else v for k, v in row.items()}
        writer.writerow(cells)
    return text.getvalue()
