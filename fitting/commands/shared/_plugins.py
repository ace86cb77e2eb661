"""Classes of the user's own: operators, effects and drivers in a Python file named on the line."""

import difflib
import functools
import hashlib
import importlib.util
import sys
from collections.abc import Mapping, Sequence
from inspect import isabstract
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, TypeVar

from cyclopts import Parameter

if TYPE_CHECKING:
    from rapi_jax.effects import AbstractEffect
    from rapi_jax.operators import AbstractOperator

Class = TypeVar("Class")
Plugins = Annotated[tuple[Path, ...], Parameter(name="--plugin", negative="", show_default=False)]


def load_plugins(paths: Sequence[Path]) -> tuple[ModuleType, ...]:
    """Import each file as a module of its own. The code in it runs: it is the user's.

    Raises `DataError` with the path where a file is missing or cannot be imported.
    """
    return tuple(_load(Path(path)) for path in paths)


def _load(path: Path) -> ModuleType:
    from rapi_jax import DataError
    from rapi_jax.io import printable

    if not path.is_file():
        raise DataError(f"{printable(path)}: no such file, so no plugin to load. Check the path.")
    return _import(path, hashlib.sha256(path.read_bytes()).hexdigest())


@functools.cache
def _import(path: Path, digest: str) -> ModuleType:
    """Import a file of this content, once: what is compiled for its classes serves all jobs."""
    from rapi_jax import DataError
    from rapi_jax.io import printable

    label = printable(path)
    name = f"rapi_plugin_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise DataError(f"{label}: not a Python file. A plugin's name ends in .py.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        reason = f"{type(error).__name__}: {printable(error)}"
        raise DataError(f"{label}: cannot be imported ({reason}). Mend the file.") from error
    return module


def plugin_classes(modules: Sequence[ModuleType], base: type[Class]) -> tuple[type[Class], ...]:
    """The concrete subclasses of `base` that the modules define themselves, in their order."""
    return tuple(
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, base)
        and value.__module__ == module.__name__
        and not isabstract(value)
    )


def plugin_effects(paths: Sequence[Path]) -> "tuple[type[AbstractEffect], ...]":
    """The effects that the files define."""
    from rapi_jax.effects import AbstractEffect

    return plugin_classes(load_plugins(paths), AbstractEffect)


def plugin_operators(paths: Sequence[Path]) -> "tuple[type[AbstractOperator], ...]":
    """The operators that the files define."""
    from rapi_jax.operators import AbstractOperator

    return plugin_classes(load_plugins(paths), AbstractOperator)


def _concrete(found: Mapping[str, object], base: type) -> list[str]:
    """The names of classes that can be used as they are."""
    return [
        name
        for name, cls in found.items()
        if isinstance(cls, type) and issubclass(cls, base) and not isabstract(cls)
    ]


def find_operator(name: str, paths: Sequence[Path]) -> "type[AbstractOperator]":
    """The operator called `name`, of the files or of this package; `ModelError` where none is."""
    from rapi_jax import ModelError, operators
    from rapi_jax.io import printable

    own = {cls.__name__: cls for cls in plugin_operators(paths)}
    cls = own.get(name, getattr(operators, name, None))
    base = operators.AbstractOperator
    if not (isinstance(cls, type) and issubclass(cls, base)) or isabstract(cls):
        known = sorted({*own, *_concrete(vars(operators), base)})
        near = difflib.get_close_matches(name, known, 1, cutoff=0.5)
        meant = f" Did you mean {near[0]}?" if near else ""
        raise ModelError(
            f"operator {printable(name)} is not known.{meant} There are {', '.join(known)}, and "
            "those that a `--plugin FILE` defines."
        )
    return cls
