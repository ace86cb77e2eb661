"""Marks of a chart, in percent of it: lines, dots, boxes; texts appear where a pointer rests."""

import dataclasses
from collections.abc import Sequence
from typing import ClassVar

from ._axis import Axis

_LEVELS = 12  # of colour on either side of zero, and in all of a scale that begins there
_STRONG = 9  # level from which on a dot has the colour of the page's ground, in both themes
_MOST_TEXTS = 1000  # of rectangles on one chart; beyond it the table alone has the values


@dataclasses.dataclass(frozen=True)
class Line:
    """A curve in a box of 1000 by 1000, which the browser stretches over the chart."""

    path: str
    colour: str
    width: float = 1.8
    kind: ClassVar[str] = "line"


@dataclasses.dataclass(frozen=True)
class Dots:
    """Points, each with its text and shape: "dot", "up" or "down"; unseen ones bear a text only."""

    places: Sequence[tuple[str, str, str, str]]
    colour: str
    radius: float = 2.5
    kind: ClassVar[str] = "dots"


@dataclasses.dataclass(frozen=True)
class Boxes:
    """Rectangles: x, y, width, height, class of colour, text."""

    places: Sequence[tuple[str, str, str, str, str, str]]
    kind: ClassVar[str] = "boxes"


@dataclasses.dataclass(frozen=True)
class Areas:
    """Rectangles without texts: for each class of colour one path, in the box of a line."""

    paths: Sequence[tuple[str, str]]
    kind: ClassVar[str] = "areas"


Mark = Line | Dots | Boxes | Areas
Box = tuple[float, float, float, float, str, str]  # left, top, width, height, class, text


def draw_line(
    axes: tuple[Axis, Axis],
    x: Sequence[float | None],
    y: Sequence[float | None],
    colour: str,
    width: float = 1.8,
) -> Line:
    """A curve, with a gap where a value is missing."""
    parts, pen = [], "M"
    for a, b in zip(x, y, strict=False):
        at, up = axes[0].place(a), axes[1].place(b)
        if at is None or up is None:
            pen = "M"
            continue
        parts.append(f"{pen}{_short(10 * at)} {_short(1000 - 10 * up)}")
        pen = "L"
    return Line("".join(parts), colour, width)


def draw_dots(
    axes: tuple[Axis, Axis],
    points: Sequence[tuple[float | None, float | None, str]],
    colour: str,
    radius: float = 2.5,
    shapes: Sequence[str] = (),
) -> Dots:
    """Points as x, y and text."""
    places = []
    for k, (a, b, text) in enumerate(points):
        at, up = axes[0].place(a), axes[1].place(b)
        if at is not None and up is not None:
            shape = shapes[k] if shapes else "dot"
            places.append((_short(at), _short(100 - up), text, shape))
    return Dots(places, colour, radius)


def draw_boxes(boxes: Sequence[Box]) -> Boxes | Areas:
    """Rectangles by left, top, width and height in percent; without their texts where many."""
    if len(boxes) > _MOST_TEXTS:
        return draw_areas(boxes)
    return Boxes([(_short(x), _short(y), _short(w), _short(h), a, b) for x, y, w, h, a, b in boxes])


def draw_areas(boxes: Sequence[Box]) -> Areas:
    """Rectangles as `draw_boxes` takes them, without their texts: a fifth of the size."""
    paths: dict[str, list[str]] = {}
    for x, y, w, h, level, _ in boxes:
        wide = _short(10 * w, 1)
        path = f"M{_short(10 * x, 1)} {_short(10 * y, 1)}h{wide}v{_short(10 * h, 1)}h-{wide}z"
        paths.setdefault(level, []).append(path)
    return Areas([(level, "".join(parts)) for level, parts in paths.items()])


def signed_level(value: float, largest: float) -> str:
    """The class of colour of a signed value: `n12` to `p12`, `z` at zero."""
    level = round(_LEVELS * value / largest) if largest > 0 else 0
    level = min(_LEVELS, max(-_LEVELS, level))
    return "z" if level == 0 else f"{'p' if level > 0 else 'n'}{abs(level)}"


def plain_level(fraction: float) -> str:
    """The class of colour of a value from 0 to 1: `v0` to `v12`."""
    return f"v{min(_LEVELS, max(0, round(_LEVELS * fraction)))}"


def is_strong(level: str) -> bool:
    """Whether a class of `plain_level` is a colour on which the colour of text is hard to see."""
    return level.startswith("v") and int(level[1:]) >= _STRONG


def _short(percent: float, digits: int = 2) -> str:
    text = f"{percent:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
