"""Strict JSON: numbers that are not finite become null, text is one indented object."""

import json
from typing import Any

import numpy as np


def replace_nonfinite(value: Any) -> Any:
    """`value` with every number that is not finite, at any depth, replaced by `None`."""
    if isinstance(value, dict):
        return {key: replace_nonfinite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [replace_nonfinite(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value


def json_text(value: Any) -> str:
    """Strict, indented JSON that ends in a newline; `ValueError` on a number that is not finite."""
    return json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
