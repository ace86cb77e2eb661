"""A model in one file: a JSON header line, the leaves, and a SHA-256 over both.

No pickle: leaves are NumPy arrays without objects, and the header only names classes: those of
this package, and those that the caller passes.
"""

import hashlib
import io
import json
from collections.abc import Callable, Sequence
from inspect import isabstract
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import equinox as eqx
import jax
import numpy as np

from rapi_jax import effects as packaged_effects
from rapi_jax import operators as packaged_operators
from rapi_jax._arguments import takes
from rapi_jax._ecdl import ECDL
from rapi_jax._errors import DataError
from rapi_jax._parameter import follow, parameters
from rapi_jax._precision import float64
from rapi_jax.effects import AbstractEffect
from rapi_jax.operators import AbstractOperator

from ._atomic import write_atomic
from ._safe import StrPath, open_regular, printable

SCHEMA = "rapi.model-file/1"
_LIMIT = 64 * 2**20
# What a header that is JSON, but not ours, or leaves that are not its, may raise on the way.
_UNREADABLE = (
    ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RuntimeError, EOFError,
)  # fmt: skip

Part = TypeVar("Part", AbstractEffect, AbstractOperator)


def _shapes(module: Any) -> dict[str, list[int]]:
    return {p.name: list(p.shape) for p in parameters(module)}


@takes(ecdl=ECDL)
@float64
def write_model(path: StrPath, ecdl: ECDL, **about: Any) -> None:
    """Write `ecdl` to `path`; `about` (units, versions, data hash, range) goes with it.

    Operator and effects may be classes of your own: hand these to `read_model`. Raises `ValueError`
    where one of them is more than its parameters, so that a file could not hold it.

    >>> from pathlib import Path
    >>> from rapi_jax.examples import paper_device
    >>> from rapi_jax.io import write_model
    >>> write_model("device.rapi", paper_device())
    >>> Path("device.rapi").stat().st_size > 100
    True
    """
    _check("operator", ecdl.operator, _operator_spec(ecdl.operator), _operator)
    for effect in ecdl.effects:
        _check("effect", effect, _effect_spec(effect), _effect)
    header = {
        "schema": SCHEMA,
        "operator": _operator_spec(ecdl.operator),
        "effects": [_effect_spec(effect) for effect in ecdl.effects],
        "about": about,
    }
    buffer = io.BytesIO()
    buffer.write(json.dumps(header, allow_nan=False).encode() + b"\n")
    eqx.tree_serialise_leaves(buffer, ecdl)
    body = buffer.getvalue()
    write_atomic(path, body + b"\n" + hashlib.sha256(body).hexdigest().encode() + b"\n")


@float64
def read_model(
    path: StrPath,
    effects: Sequence[type[AbstractEffect]] = (),
    operators: Sequence[type[AbstractOperator]] = (),
) -> tuple[ECDL, dict[str, Any]]:
    """The model in `path`, and what was written about it.

    `path`: a file, or the folder that `rapi fit` or `rapi diagnose` wrote, which has `model.rapi`.
    `effects`, `operators`: classes that are not this package's, for a model that has them.

    Raises `DataError` where the file is not a model, is damaged, or names a class that is not
    known.

    >>> from rapi_jax.examples import paper_device
    >>> from rapi_jax.io import read_model, write_model
    >>> write_model("device.rapi", paper_device(), units={"response": "GHz"})
    >>> laser, about = read_model("device.rapi")
    >>> laser.operator.count, about["units"]
    (10, {'response': 'GHz'})
    """
    path = Path(path)
    path = path / "model.rapi" if path.is_dir() else path
    label = printable(path)
    jax.devices()  # an unknown JAX_PLATFORMS fails here, and is not taken for a fault of the file
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
        header = json.loads(line, parse_constant=_no_constant)
        if header["schema"] != SCHEMA:
            raise DataError(
                f"{label}: schema {printable(header['schema'])}, but this reads {SCHEMA}."
            )
        around = tuple(_effect(spec, effects) for spec in header["effects"])
        skeleton = ECDL(_operator(header["operator"], operators), around)
        about = header["about"]
        if not isinstance(about, dict):
            raise DataError("`about` must be an object. Fit again.")
        ecdl = eqx.tree_deserialise_leaves(io.BytesIO(leaves), skeleton, _present(header, skeleton))
        _check_finite(ecdl)
    except DataError as error:
        raise DataError(f"{label}: {error}") from error
    except _UNREADABLE as error:
        raise DataError(f"{label}: not a model this version reads ({printable(error)}).") from error
    return ecdl, about


def _no_constant(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _check_finite(ecdl: ECDL) -> None:
    """Refuse a parameter that is not a number; infinite is only what its default is, too."""
    for part in (ecdl.operator, *ecdl.effects):
        default = type(part).at() if isinstance(part, AbstractEffect) else None
        for one in parameters(part):
            value = np.asarray(follow(part, one.path))
            free = default is not None and np.isinf(np.asarray(follow(default, one.path))).any()
            if np.isnan(value).any() or (np.isinf(value).any() and not free):
                raise DataError(
                    f"parameter `{one.name}` of {type(part).__name__} is not finite. Fit again."
                )


def _present(header: dict[str, Any], skeleton: ECDL) -> Any:
    """How to read each leaf: those that the file's version did not know keep their defaults."""
    specs = [header["operator"], *header["effects"]]
    parts = [(skeleton.operator, ("operator",))]
    parts += [(effect, ("effects", i)) for i, effect in enumerate(skeleton.effects)]
    missing = [
        (*path, *p.path)
        for spec, (part, path) in zip(specs, parts, strict=True)
        for p in parameters(part)
        if p.name not in spec["shapes"]
    ]
    read = jax.tree_util.tree_map(lambda _: eqx.default_deserialise_filter_spec, skeleton)
    keep = [lambda file, leaf: leaf] * len(missing)
    return eqx.tree_at(lambda e: [follow(e, path) for path in missing], read, keep)


def _filled(shapes: dict[str, list[int]]) -> dict[str, np.ndarray]:
    if any(np.prod(shape, dtype=float) > 1e6 for shape in shapes.values()):
        raise DataError("a parameter of more than a million elements.")
    return {name: np.ones(tuple(shape)) for name, shape in shapes.items()}


def _packaged(module: ModuleType, base: type[Part]) -> dict[str, type[Part]]:
    """The concrete subclasses of `base` that this package's `module` exports, by name."""
    return {
        cls.__name__: cls
        for cls in vars(module).values()
        if isinstance(cls, type) and issubclass(cls, base) and not isabstract(cls)
    }


def _packaged_operators() -> dict[str, type[AbstractOperator]]:
    return _packaged(packaged_operators, AbstractOperator)


def _packaged_effects() -> dict[str, type[AbstractEffect]]:
    return _packaged(packaged_effects, AbstractEffect)


def _operator_spec(operator: AbstractOperator) -> dict[str, Any]:
    cls = type(operator)
    spec = {"class": cls.__name__, "plays": operator.count, "shapes": _shapes(operator)}
    packaged = _packaged_operators().get(cls.__name__) is cls
    return spec if packaged else spec | {"packaged": False}


def _effect_spec(effect: AbstractEffect) -> dict[str, Any]:
    cls = type(effect)
    packaged = _packaged_effects().get(cls.__name__) is cls
    return {"class": cls.__name__, "packaged": packaged, "shapes": _shapes(effect)}


def _operator(spec: dict[str, Any], own: Sequence[type[AbstractOperator]]) -> AbstractOperator:
    cls = _class(spec, "operator", _packaged_operators(), own)
    return cls.from_parameters(_filled(spec["shapes"]), plays=int(spec["plays"]))


def _effect(spec: dict[str, Any], own: Sequence[type[AbstractEffect]]) -> AbstractEffect:
    return _class(spec, "effect", _packaged_effects(), own).at(**_filled(spec["shapes"]))


def _class(
    spec: dict[str, Any], kind: str, packaged: dict[str, type[Part]], own: Sequence[type[Part]]
) -> type[Part]:
    """The class that a header names, of this package or among those handed over."""
    name = str(spec["class"])
    if spec.get("packaged", True):
        cls = packaged.get(name)
        if cls is None:
            raise DataError(f"{kind} {printable(name)} is not known; a newer version wrote it.")
        return cls
    cls = {cls.__name__: cls for cls in own}.get(name)
    if cls is None:
        raise DataError(
            f"{kind} {printable(name)} is not one of this package: give its class as "
            f"`read_model(path, {kind}s=({printable(name)},))`, or its file as `--plugin FILE`."
        )
    return cls


def _check(
    kind: str,
    part: Part,
    spec: dict[str, Any],
    build: Callable[[dict[str, Any], Sequence[type[Part]]], Part],
) -> None:
    """Refuse a part of a model that its parameters do not make up."""
    cls = type(part)
    try:
        again = build(spec, (cls,))
    except (TypeError, ValueError, DataError) as error:
        again, reason = None, f" ({printable(error)})"
    else:
        reason = ""
    if jax.tree.structure(again) != jax.tree.structure(part):
        raise ValueError(
            f"{kind} {cls.__name__} cannot be made again from its parameters alone{reason}, so no "
            "model file can hold it. Declare each field by `rapi_jax.parameter`."
        )
