"""A model in one file: a JSON header line, the leaves, and a SHA-256 over both.

No pickle: leaves are NumPy arrays without objects, and the header only names classes: those of
this package, and those that the caller passes.
"""

import hashlib
import io
import json
from collections.abc import Sequence
from inspect import isabstract
from typing import Any

import equinox as eqx
import jax
import numpy as np

from rapi_jax import effects as package
from rapi_jax import operators
from rapi_jax._ecdl import ECDL
from rapi_jax._errors import DataError
from rapi_jax._parameter import parameters
from rapi_jax._precision import float64
from rapi_jax.effects import AbstractEffect

from ._atomic import write_atomic
from ._safe import StrPath, open_regular, printable

SCHEMA = "rapi.model-file/1"
_LIMIT = 64 * 2**20
_KNOWN = (operators.RAPI, operators.PI, operators.InverseRAPI, operators.GeneralRAPI)
_OPERATORS = {cls.__name__: cls for cls in _KNOWN}


def _shapes(module: Any) -> dict[str, list[int]]:
    return {p.name: list(p.shape) for p in parameters(module)}


@float64
def write_model(path: StrPath, ecdl: ECDL, **about: Any) -> None:
    """Write `ecdl` to `path`; `about` (units, versions, data hash, range) goes with it.

    Effects may be classes of your own: hand these to `read_model`. Raises `ValueError` where one of
    them is more than its parameters, so that a file could not hold it.
    """
    for effect in ecdl.effects:
        _check(effect)
    header = {
        "schema": SCHEMA,
        "operator": {
            "class": type(ecdl.operator).__name__,
            "plays": ecdl.operator.count,
            "shapes": _shapes(ecdl.operator),
        },
        "effects": [_spec(e) for e in ecdl.effects],
        "about": about,
    }
    buffer = io.BytesIO()
    buffer.write(json.dumps(header, allow_nan=False).encode() + b"\n")
    eqx.tree_serialise_leaves(buffer, ecdl)
    body = buffer.getvalue()
    write_atomic(path, body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n")


@float64
def read_model(
    path: StrPath, effects: Sequence[type[AbstractEffect]] = ()
) -> tuple[ECDL, dict[str, Any]]:
    """The model in `path`, and what was written about it.

    `effects`: classes of effects that are not this package's, for a model that has them.

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
        own = {cls.__name__: cls for cls in effects}
        around = tuple(_effect(spec, own) for spec in header["effects"])
        skeleton = ECDL(_operator(header["operator"]), around)
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


def _packaged() -> dict[str, type[AbstractEffect]]:
    """The effects of this package."""
    return {
        cls.__name__: cls
        for cls in vars(package).values()
        if isinstance(cls, type) and issubclass(cls, AbstractEffect) and not isabstract(cls)
    }


def _spec(effect: AbstractEffect) -> dict[str, Any]:
    cls = type(effect)
    packaged = _packaged().get(cls.__name__) is cls
    return {"class": cls.__name__, "packaged": packaged, "shapes": _shapes(effect)}


def _check(effect: AbstractEffect) -> None:
    """Refuse an effect that its parameters do not make up."""
    cls = type(effect)
    try:
        again = _effect(_spec(effect), {cls.__name__: cls})
    except (TypeError, ValueError, DataError) as error:
        again, reason = None, f" ({printable(error)})"
    else:
        reason = ""
    if jax.tree.structure(again) != jax.tree.structure(effect):
        raise ValueError(
            f"effect {cls.__name__} cannot be made again from its parameters alone{reason}, so no "
            "model file can hold it. Declare each field by `rapi_jax.parameter`."
        )


def _effect(spec: dict[str, Any], own: dict[str, type[AbstractEffect]]) -> AbstractEffect:
    name = str(spec["class"])
    if not spec.get("packaged", True):
        cls = own.get(name)
        if cls is None or not issubclass(cls, AbstractEffect):
            raise DataError(
                f"effect {printable(name)} is not one of this package: give its class as "
                f"`read_model(path, effects=({printable(name)},))`, or its file as `--plugin FILE`."
            )
        return cls.at(**_filled(spec["shapes"]))
    cls = _packaged().get(name)
    if cls is None:
        raise DataError(f"effect {printable(name)} is not known; a newer version wrote it.")
    return cls.at(**_filled(spec["shapes"]))
