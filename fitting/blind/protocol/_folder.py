"""A bank on disk: where its parts lie, and what `bank.json` says.

```
BANK/bank.json, commitment.json    what is in it; for a sealed one the hash of its secret
BANK/recordings/NAME/              what a diagnosis is given
BANK/answers/NAME.json, NAME.salt  what it is not given; secret, from which salts are made
BANK/predictions/NAME.json, NAME/  what it said; predictions.json holds their hashes
BANK/follow/advised, random        second sessions of devices whose diagnosis was tied
BANK/scores.json, scores.md, failures.csv
BANK/compiled/                     what diagnoses have compiled without the user's cache
```
"""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from rapi_jax import DataError
from rapi_jax.io import OutputError, printable, write_atomic

SCHEMA = "rapi.blind/1"
_COMPILED = "compiled"
_PARTS = {
    "bank.json",
    "commitment.json",
    "recordings",
    "answers",
    "predictions",
    "predictions.json",
    "follow",
    "scores.json",
    "scores.md",
    "failures.csv",
    _COMPILED,
}
_TEMPORARY = ".tmp-"  # what a killed process leaves of a file it was writing


@dataclass(frozen=True)
class BankFolder:
    """Paths of a bank, whether they are there or not."""

    root: Path

    @property
    def bank(self) -> Path:
        """What is in the bank."""
        return self.root / "bank.json"

    @property
    def commitment(self) -> Path:
        """The hash of a sealed bank's secret."""
        return self.root / "commitment.json"

    @property
    def recordings(self) -> Path:
        """One folder a recording."""
        return self.root / "recordings"

    @property
    def answers(self) -> Path:
        """What is withheld."""
        return self.root / "answers"

    @property
    def secret(self) -> Path:
        """32 bytes from which salts, and a sealed bank's devices, are made."""
        return self.answers / "secret"

    @property
    def predictions(self) -> Path:
        """One file and one folder of models a recording."""
        return self.root / "predictions"

    @property
    def closed(self) -> Path:
        """The hashes of all predictions, written once."""
        return self.root / "predictions.json"

    @property
    def follow(self) -> Path:
        """Second sessions and what was said of them."""
        return self.root / "follow"

    @property
    def scores(self) -> Path:
        """The scores, with the secret."""
        return self.root / "scores.json"

    @property
    def compiled(self) -> Path:
        """The compilation cache that all diagnoses of the bank share."""
        return self.root / _COMPILED

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """`bank.json`. Raises `DataError` where it is not there or not what it should be."""
        if not self.bank.exists():
            raise DataError(
                f"{printable(self.root)}: no bank.json in this folder, so it is no finished bank. "
                "`rapi blind make` makes one, and goes on where it was interrupted."
            )
        manifest = read_json(self.bank)
        if manifest.get("schema") != SCHEMA:
            raise DataError(
                f"{printable(self.bank)}: schema {printable(manifest.get('schema'))}, but this "
                f"reads {SCHEMA}. Use the version that made the bank, or make a new one."
            )
        try:
            names = [entry["name"] for entry in manifest["recordings"]]
            whole = set(names) == set(manifest["commitments"]) and len(names) == manifest["count"]
        except (KeyError, TypeError):
            whole = False
        if not whole:
            raise DataError(
                f"{printable(self.bank)}: recordings, commitments and count do not agree, so it "
                "was edited or cut short. Make the bank again."
            )
        return manifest

    @property
    def entries(self) -> list[tuple[str, str | None]]:
        """Name of each recording and of the effect that is taken from its candidates, in order."""
        return [(entry["name"], entry["withheld"]) for entry in self.manifest["recordings"]]

    @property
    def sealed(self) -> bool:
        """Whether the bank may be used once only."""
        return self.manifest["tier"] == "sealed"


def read_json(path: Path) -> dict[str, Any]:
    """One JSON object. Raises `DataError` with the path where there is none."""
    try:
        value = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise DataError(
            f"{printable(path)}: no such file. It was removed, or never written; make it again."
        ) from None
    except (ValueError, RecursionError) as error:
        raise DataError(
            f"{printable(path)}: not valid JSON ({printable(error)}), so it was edited or damaged. "
            "Restore it, or make it again."
        ) from error
    if not isinstance(value, dict):
        raise DataError(f"{printable(path)}: holds no JSON object. Restore it, or make it again.")
    return value


def json_bytes(value: Any) -> bytes:
    """JSON of which the same value always makes the same bytes."""
    text = json.dumps(value, indent=1, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return text.encode() + b"\n"


def write_json(path: Path, value: Any) -> None:
    """Write `json_bytes(value)`, whole or not at all."""
    write_atomic(path, json_bytes(value))


def make_folder(path: Path, *, private: bool = False) -> Path:
    """`path` as a folder that is there; `private`: for its owner's eyes only."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        if private:
            path.chmod(0o700)
    except OSError as error:
        raise OutputError(
            f"cannot make the folder {printable(path)}: {error.strerror}. Choose another."
        ) from error
    return path


def refuse_unknown_files(folder: Path, known: set[str] | None = None) -> None:
    """Raise `OutputError` where `folder` holds a file that is none of `known` (a bank's parts)."""
    if not folder.is_dir():
        if folder.exists():
            raise OutputError(f"{printable(folder)} is there and is not a folder. Choose another.")
        return
    allowed = _PARTS if known is None else known
    for name in sorted(entry.name for entry in folder.iterdir()):
        if name not in allowed and not name.startswith(_TEMPORARY):
            raise OutputError(
                f"{printable(folder)} holds {printable(name)}, which is no part of this bank: it "
                "is of another tier, seed or count, or foreign. Choose another folder."
            )
