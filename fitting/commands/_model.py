"""A model from the command line: the folder a command wrote, or a file in it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any


def load_model(
    model: Path, effects: Sequence[type[Any]] = (), operators: Sequence[type[Any]] = ()
) -> tuple[Any, dict[str, Any]]:
    """The model that `model` names, and the header written with it.

    `effects`, `operators`: classes that the model names and that are not the package's own.
    Raises `ModelError` where there is no such file.
    """
    from fitting.report import MODEL, TABLE
    from rapi_jax import ModelError
    from rapi_jax.io import read_model

    path = model / MODEL if model.is_dir() else model
    path = path.with_name(MODEL) if path.name == TABLE else path  # the readable one, beside it
    if not path.exists():
        raise ModelError(f"{path}: no such model. Give a folder that `rapi fit` wrote.")
    return read_model(path, effects=effects, operators=operators)
