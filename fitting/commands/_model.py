"""A model from the command line: the folder a command wrote, or a file in it."""

from pathlib import Path
from typing import Any


def load_model(model: Path) -> tuple[Any, dict[str, Any]]:
    """The model that `model` names, and what was written about it; `ModelError` where none is."""
    from fitting.report import MODEL, TABLE
    from rapi_jax import ModelError
    from rapi_jax.io import read_model

    path = model / MODEL if model.is_dir() else model
    path = path.with_name(MODEL) if path.name == TABLE else path  # the readable one, beside it
    if not path.exists():
        raise ModelError(f"{path}: no such model. Give a folder that `rapi fit` wrote.")
    return read_model(path)
