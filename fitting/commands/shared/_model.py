"""A model from the command line: the folder a command wrote, or a file in it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rapi_jax import ModelError


class UntrustedModel(ModelError):
    """A model whose fit was not to be trusted, asked for a drive."""


def check_trusted(about: dict[str, Any], *, allowed: bool) -> None:
    """Raise `UntrustedModel` for a model that its fit did not trust, unless that is `allowed`."""
    if about.get("trusted", False) or allowed:
        return
    first, more = _reasons(about)
    raise UntrustedModel(
        f"no drive is made from a model that is not to be trusted: {first}{more}. "
        "Mend the recording and fit again, or ask for it with `--untrusted`."
    )


def describe_distrust(about: dict[str, Any] | None) -> tuple[str, ...]:
    """A note on a model, described by `about`, that its fit did not trust; nothing of others."""
    if about is None or about.get("trusted", True):
        return ()
    known = about.get("reasons")
    first, more = _reasons(about) if known else ("", "")
    why, lists = (f": {first}{more}", "Mend that") if known else ("", "Mend its recording")
    return (
        f"model: the model given by `--model` was not to be trusted when it was written{why}. Its "
        "own errors count as a gap of the device here, and an effect may be named for them. "
        f"{lists} and fit again, or diagnose without `--model`.",
    )


def _reasons(about: dict[str, Any]) -> tuple[str, str]:
    """The first reason not to trust a model, and how many more there are, in words."""
    reasons = about.get("reasons") or ["see its model.json"]
    more = f" (and {len(reasons) - 1} more)" if len(reasons) > 1 else ""
    return reasons[0].rstrip("."), more


def is_diagnosis(model: Path) -> bool:
    """Whether a model, as named on the command line, lies in the folder of a diagnosis."""
    from fitting.report.diagnosis._files import DIAGNOSIS

    folder = model if model.is_dir() else model.parent
    return (folder / DIAGNOSIS).is_file()


def load_model(
    model: Path, effects: Sequence[type[Any]] = (), operators: Sequence[type[Any]] = ()
) -> tuple[Any, dict[str, Any]]:
    """The model that `model` names, and the header written with it.

    `effects`, `operators`: classes that the model names and that are not the package's own.
    Raises `ModelError` where there is no such file.
    """
    from fitting._result_files import MANIFEST, check_belongs
    from fitting.report import MODEL, TABLE
    from rapi_jax.io import read_model

    path = model / MODEL if model.is_dir() else model
    path = path.with_name(MODEL) if path.name == TABLE else path  # the readable one, beside it
    if not path.exists():
        exchanged = (
            f" {model} is a recording: are the model and the recording exchanged?"
            if (model / MANIFEST).is_file()
            else ""
        )
        raise ModelError(f"{path}: no such model. Give a folder that `rapi fit` wrote.{exchanged}")
    check_belongs(path)
    return read_model(path, effects=effects, operators=operators)
