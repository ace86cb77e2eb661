"""Arguments of public functions that are of another class: said at once, with the way to it."""

import functools
import inspect
import os
from collections.abc import Callable, Iterable
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, get_args

P = ParamSpec("P")
T = TypeVar("T")

# How to get what is wanted (second) from what was given (first). `path`: a str or a Path; `*X`: a
# list or tuple of X. Names, since classes of `fitting` are given to functions of `rapi_jax`, too.
_WAYS = {
    ("path", "Recording"): "Read it first: `rapi_jax.io.read_recording(path)`.",
    ("path", "ECDL"): "Read it first: `rapi_jax.io.read_model(path)`.",
    ("path", "Drive"): "Read it first: `rapi_jax.io.read_drive(path)`.",
    ("path", "DriveLimits"): "Read it first: `rapi_jax.io.read_limits(path)`.",
    ("path", "FitResult"): "A fit is made by `fitting.identify(recording)`.",
    ("Imported", "Recording"): "Give the recording in it: `imported.recording`.",
    ("Run", "Recording"): "Put it into one: `Recording((run,))`.",
    ("FitResult", "Recording"): "Give the one that was fitted: `result.recording`.",
    ("FitResult", "ECDL"): "Give the model in it: `result.ecdl`.",
    ("FitResult", "AbstractOperator"): "Give the operator in it: `result.ecdl.operator`.",
    ("FitResult", "Claim"): "Give the claim in it: `result.claim`.",
    ("FitResult", "Identified"): "Give the range of its data: `Identified.of(result.recording)`.",
    ("Diagnosis", "ECDL"): "Give the model in it: `diagnosis.model`.",
    ("AbstractOperator", "ECDL"): "Wrap the operator: `ECDL(operator)`.",
    ("Recording", "ECDL"): "A model is identified by `fitting.identify(recording)`: `result.ecdl`.",
    ("ECDL", "AbstractOperator"): "Give the operator in it: `ecdl.operator`.",
    ("ECDL", "FitResult"): "A result is made by `fitting.fit(ecdl, recording)`.",
    ("Recording", "Drive"): "Give the drive of a run: `recording.runs[0].drive`.",
    ("Run", "Drive"): "Give the drive of it: `run.drive`.",
    ("Compensation", "Drive"): "Give the drive in it: `made.drive`.",
    ("Recording", "Run"): "Give one of its runs: `recording.runs[0]`.",
    ("Recording", "Identified"): "Give its range: `Identified.of(recording)`.",
    ("Recording", "FitResult"): "A recording is fitted by `fitting.identify(recording)`.",
    ("*Target", "Target"): "`linear_scan` gives a target for each rate: `(target,) = "
    "linear_scan(...)`.",
    ("*Drive", "Drive"): "A waveform gives a drive for each rate: `(drive,) = triangle(...)`.",
    ("Drive", "Target"): "A target is made by `linear_scan(...)` or `Target.of(values, rate)`.",
}  # fmt: skip


def takes(**kinds: Any) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A function whose arguments are of `kinds`, by name; else a `TypeError` before it starts.

    A kind is a class, a union such as `ECDL | None`, or a list of one: a list or tuple of such.
    An argument that is left out has its default. Only classes are looked at, so models and arrays
    that JAX traces pass.

    >>> from rapi_jax import predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> try:
    ...     predict(paper_device(), triangle(10.0, amplitude=4.5, bias=3.0))
    ... except TypeError as error:
    ...     print(str(error).split(". ")[0])
    Argument `drive` must be a Drive, but is a tuple of 1 Drive
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        places = {name: k for k, name in enumerate(inspect.signature(function).parameters)}
        checks = [(name, places[name], kind) for name, kind in kinds.items()]

        @functools.wraps(function)
        def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
            for name, place, kind in checks:
                if place < len(args):
                    _check(name, args[place], kind)
                elif name in kwargs:
                    _check(name, kwargs[name], kind)
            return function(*args, **kwargs)

        return wrapped

    return decorate


def _check(name: str, value: Any, kind: Any) -> None:
    if not isinstance(kind, list):
        if not isinstance(value, kind):
            raise TypeError(_message(f"Argument `{name}` must be", value, kind))
        return
    (one,) = kind
    if isinstance(value, one | str | os.PathLike) or not isinstance(value, Iterable):
        wanted = " or ".join(kind.__name__ for kind in _classes(one))
        raise TypeError(
            f"Argument `{name}` must be a list of {wanted}, but is {_given(value)}. "
            f"{_way(value, one) or f'Give a list: `[{name}]`.'}"
        )
    for place, item in enumerate(value if isinstance(value, list | tuple) else ()):
        if not isinstance(item, one):
            raise TypeError(_message(f"`{name}[{place}]` must be", item, one))


def _message(start: str, value: Any, kind: Any) -> str:
    wanted = " or ".join(
        "None" if one is NoneType else _with_article(one.__name__) for one in _classes(kind)
    )
    way = _way(value, kind)
    return f"{start} {wanted}, but is {_given(value)}.{' ' if way else ''}{way}"


def _classes(kind: Any) -> tuple[type, ...]:
    return get_args(kind) if isinstance(kind, UnionType) else (kind,)


def _names(value: Any) -> list[str]:
    """The classes of `value` as `_WAYS` names them."""
    if isinstance(value, str | os.PathLike):
        return ["path"]
    if isinstance(value, list | tuple) and value:
        return ["*" + type(value[0]).__name__]
    return [cls.__name__ for cls in type(value).__mro__]


def _way(value: Any, kind: Any) -> str:
    pairs = ((name, one.__name__) for one in _classes(kind) for name in _names(value))
    return next((_WAYS[pair] for pair in pairs if pair in _WAYS), "")


def _given(value: Any) -> str:
    if value is None:
        return "None"
    article = _with_article(type(value).__name__)
    if isinstance(value, str | os.PathLike):
        return f"{article} ({ascii(os.fspath(value))[:60]})"
    if isinstance(value, list | tuple) and value:
        return f"{article} of {len(value)} {type(value[0]).__name__}"
    return article


def _with_article(name: str) -> str:
    name = name.removeprefix("Abstract")
    return f"an {name}" if name[0] in "AEIOU" else f"a {name}"
