"""What is wrong with a bench file, in one line: the key, and for one misspelt the one meant."""

import difflib
from typing import Any

import pydantic

from hardware._driver import Table
from rapi_jax.io import printable

from ._drivers import FAMILIES, Drivers, find_driver

_LIKE = 0.6  # of `difflib`, its default: of two words of 10 letters 6 are in common and in order


def describe_mistake(
    error: pydantic.ValidationError, table: dict[str, Any], root: type[Table], drivers: Drivers
) -> str:
    """The first mistake in `table`, the content of the file, as `root` and the drivers have it.

    An unknown key comes first: misspelt, it also leaves the one that was meant missing.
    """
    errors = error.errors()
    first = next((one for one in errors if one["type"] == "extra_forbidden"), errors[0])
    loc = tuple(str(part) for part in first["loc"])
    where = printable(_path(loc, table), 60)
    if first["type"] != "extra_forbidden":
        message = first["msg"].removeprefix("Value error, ")
        return f"`{where}`: {printable(message, 120)}."
    known = _keys(loc[:-1], table, root, drivers)
    given = _inside(table, loc[:-1])
    free = [key for key in known if key not in given]
    near = difflib.get_close_matches(loc[-1][:60], free, n=1, cutoff=_LIKE)
    if near:
        return f"`{where}`: no such key; is `{near[0]}` meant? Correct or remove it."
    return f"`{where}`: no such key. Remove it, or use one of {', '.join(known)}."


def _keys(
    loc: tuple[str, ...], table: dict[str, Any], root: type[Table], drivers: Drivers
) -> list[str]:
    """The keys that the table at `loc` may have."""
    found: Any = root
    for part in loc:
        if part in FAMILIES:
            own = table[part].get("kind", next(iter(drivers[part])))
            found = find_driver(drivers, part, str(own)).Table
        else:
            annotation = found.model_fields[part].annotation
            options = getattr(annotation, "__args__", (annotation,))  # `Air | None`
            found = next(one for one in options if hasattr(one, "model_fields"))
    return [field.alias or name for name, field in found.model_fields.items()]


def _inside(table: Any, loc: tuple[str, ...]) -> Any:
    for part in loc:
        table = table[part]
    return table


def _path(loc: tuple[str, ...], table: dict[str, Any]) -> str:
    """The key that is wrong, behind the kind of its instrument where the file names one."""
    parts = list(loc)
    if len(parts) > 1 and parts[0] in FAMILIES and "kind" in table[parts[0]]:
        parts.insert(1, str(table[parts[0]]["kind"]))
    return ".".join(parts) or "the file"
