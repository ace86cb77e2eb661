"""Objects of a class with a few of its fields alone, for functions that read no others."""

from typing import Any, TypeVar

One = TypeVar("One")


def bare(cls: type[One], **fields: Any) -> One:
    """One of a class, made without its constructor."""
    one = object.__new__(cls)
    for name, value in fields.items():
        object.__setattr__(one, name, value)
    return one
