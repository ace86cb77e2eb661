"""What was computed of late, kept for the next call with the same objects."""

from collections.abc import Callable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Recent(Generic[Value]):
    """The values of the last few keys; a key is a tuple of objects, compared by identity.

    A secant changes one effect and leaves all other objects as they are, so that identity tells
    what need not be computed again. Of numbers that may be changed in place their bytes are given,
    which are compared.
    """

    def __init__(self, size: int):
        self._size = size
        self._entries: list[tuple[tuple[object, ...], Value]] = []

    def get(self, key: tuple[object, ...], make: Callable[[], Value]) -> Value:
        """The value of `key`, made where it is not among the last ones."""
        for place, (other, value) in enumerate(self._entries):
            if len(other) == len(key) and all(map(_same, other, key)):
                self._entries.insert(0, self._entries.pop(place))
                return value
        value = make()
        self._entries.insert(0, (key, value))
        del self._entries[self._size :]
        return value


def _same(one: object, other: object) -> bool:
    return one is other or (isinstance(one, bytes) and one == other)
