"""A model in one file: a JSON header line, the leaves, and a SHA-256 over both.

No pickle: leaves are NumPy arrays without objects, and the header only names classes that this
package knows.
"""

import hashlib
import io
import json
from typing import Any

import equinox as eqx
import numpy as np

from .. import effects, operators
from .._ecdl import ECDL
from .._errors import DataError
from .._parameter import parameters
from .._precision import float64
from ._atomic import write_atomic
from ._safe import StrPath, open_regular, printable

SCHEMA = "rapi.model-file/1"
_LIMIT = 64 * 2**20
_OPERATORS = {cls.__name__: cls for cls in (operators.RAPI, operators.PI, operators.InverseRAPI)}


def _shapes(module: Any) -> dict[str, list[int]]:
    return {p.name: list(p.shape) for p in parameters(module)}


@float64
def write_model(path: StrPath, ecdl: ECDL, **about: Any) -> None:
    """Write `ecdl` to `path`; `about` (units, versions, data hash, range) goes with it."""
    header = {
        "schema": SCHEMA,
        "operator": {
            "class": type(ecdl.operator).__name__,
            "plays": ecdl.operator.count,
            "shapes": _shapes(ecdl.operator),
        },
        "effects": [{"class": type(e).__name__, "shapes": _shapes(e)} for e in ecdl.effects],
        "about": about,
    }
    buffer = io.BytesIO()
    buffer.write(json.dumps(header, allow_nan=False).encode() + b"\n")
    eqx.tree_serialise_leaves(buffer, ecdl)
    body = buffer.getvalue()
    write_atomic(path, body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n")


@float64
def read_model(path: StrPath) -> tuple[ECDL, dict[str, Any]]:
    """The model in `path`, and what was written about it.

    Raises `DataError` where the file is not a model, is damaged, or names a class that is not
    known.
    """
    label = printable(path)
    with open_regular(path, _LIMIT) as file:
        content = file.read()
    body, _, tail = content.rstrip(b"\n").rpartition(b"\n")
    if hashlib.sha256(body).hexdigest().encode() != tail:
        raise DataError(
            f"{label}: not a model file, or damaged: its checksum does not match. Copy it again, "
            "or fit again."
        )
    line, _, leaves = body.partition(b"\n")
    try:
        header = json.loads(line)
        if header["schema"] != SCHEMA:
            raise DataError(
                f"{label}: schema {printable(header['schema'])}, but this reads {SCHEMA}."
            )
        skeleton = ECDL(_operator(header["operator"]), tuple(map(_effect, header["effects"])))
        ecdl = eqx.tree_deserialise_leaves(io.BytesIO(leaves), skeleton)
    except DataError as error:
        raise DataError(f"{label}: {error}") from error
    except (ValueError, KeyError, TypeError, RuntimeError, EOFError) as error:
        raise DataError(f"{label}: not a model this version reads ({printable(error)}).") from error
    return ecdl, header["about"]


def _filled(shapes: dict[str, list[int]]) -> dict[str, np.ndarray]:
    if any(np.prod(shape, dtype=float) > 1e6 for shape in shapes.values()):
        raise DataError("a parameter of more than a million elements.")
    return {name: np.ones(tuple(shape)) for name, shape in shapes.items()}


def _operator(spec: dict[str, Any]) -> operators.AbstractOperator:
    cls = _OPERATORS.get(spec["class"])
    if cls is None:
        raise DataError(
            f"operator {printable(spec['class'])} is not known; a newer version wrote it."
        )
    fields: dict[str, Any] = dict(_filled(spec["shapes"]))
    if cls is not operators.PI:
        fields["plays"] = int(spec["plays"])
    return cls(**fields)


def _effect(spec: dict[str, Any]) -> effects.AbstractEffect:
    cls = getattr(effects, str(spec["class"]), None)
    if not (isinstance(cls, type) and issubclass(cls, effects.AbstractEffect)):
        raise DataError(
            f"effect {printable(spec['class'])} is not known; a newer version wrote it."
        )
    return cls(**_filled(spec["shapes"]))
