"""Colours of lines and marks: contrast (WCAG 2.1, 1.4.11) in both themes, and colour blindness."""

import itertools
import re

import numpy as np
import pytest

from fitting.report._pages import read_style
from fitting.report.charts._figure import ordered_colour
from fitting.report.charts._marks import is_strong
from rapi_jax.plot._style import DOWN, MEASURED, MODEL, PALETTE, UP

LEAST = 3.0  # of marks that carry meaning
APART = 9.0  # hundredths of Oklab's lightness; 2 is just seen side by side
CLOSE = 7.0  # of six shades in a row, none of which may be faint
# Machado, Oliveira and Fernandes (2009), severity 1, in linear light.
EYES = (
    np.eye(3),
    np.array(  # deuteranopia
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    np.array(  # protanopia
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
)
CONES = np.array(  # Ottosson (2020), from linear sRGB
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
OKLAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
# The CSS matrix of `hue-rotate(180deg)`.
TURNED = np.array([[-0.574, 1.43, 0.144], [0.426, 0.43, 0.144], [0.426, 1.43, -0.856]])


def rgb(name: str) -> np.ndarray:
    return np.array([int(name[i : i + 2], 16) / 255 for i in (1, 3, 5)])


def linear(colour: np.ndarray) -> np.ndarray:
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


def contrast(one: np.ndarray, other: np.ndarray) -> float:
    low, high = sorted(linear(c) @ [0.2126, 0.7152, 0.0722] + 0.05 for c in (one, other))
    return high / low


def distance(one: np.ndarray, other: np.ndarray) -> float:
    """The smallest of any of the three kinds of eyes."""
    seen = [
        [OKLAB @ np.cbrt(CONES @ np.clip(eye @ linear(c), 0.0, 1.0)) for c in (one, other)]
        for eye in EYES
    ]
    return min(100.0 * float(np.linalg.norm(a - b)) for a, b in seen)


def scheme(dark: bool) -> dict[str, np.ndarray]:
    """The colours of the style sheet."""
    parts = read_style().split("prefers-color-scheme")
    found = re.findall(r"--([\w-]+): (#[0-9a-f]{6})", parts[1 if dark else 0])
    return {name: rgb(value) for name, value in found}


def on_page(colour: np.ndarray, dark: bool) -> np.ndarray:
    """A colour of a picture as the page shows it."""
    if not dark:
        return colour
    (share,) = re.findall(r"filter: invert\(([\d.]+)\) hue-rotate\(180deg\)", read_style())
    inverted = float(share) + (1.0 - 2.0 * float(share)) * colour
    return np.clip(TURNED @ inverted, 0.0, 1.0)


BOTH = pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])


@BOTH
def test_lines_of_pictures_stand_out(dark):
    ground = on_page(np.ones(3), dark)
    for name in {MEASURED, MODEL, UP, DOWN, *PALETTE}:
        assert contrast(on_page(rgb(name), dark), ground) >= LEAST, name


@BOTH
@pytest.mark.parametrize("colours", [(MEASURED, MODEL, UP, DOWN), PALETTE])
def test_lines_of_one_picture_are_told_apart(dark, colours):
    for one, other in itertools.combinations(colours, 2):
        shown = (on_page(rgb(name), dark) for name in (one, other))
        assert distance(*shown) >= APART, (one, other)


def mixed(text: str, colours: dict[str, np.ndarray]) -> np.ndarray:
    """A colour that a chart asks for; a mixture by light, as near as it needs be."""
    names = re.findall(r"var\(--(\w+)\)", text)
    if len(names) == 1:
        return colours[names[0]]
    share = int(re.findall(r"(\d+)%", text)[0]) / 100
    return share * colours[names[0]] + (1.0 - share) * colours[names[1]]


@BOTH
@pytest.mark.parametrize(("count", "least"), [(2, APART), (3, APART), (4, APART), (6, CLOSE)])
def test_curves_in_order_stand_out_and_differ_from_their_neighbours(dark, count, least):
    colours = scheme(dark)
    shown = [mixed(ordered_colour(k, count), colours) for k in range(count)]
    assert all(contrast(one, colours["ground"]) >= LEAST for one in shown)
    assert all(distance(a, b) >= least for a, b in itertools.pairwise(shown))


@BOTH
def test_a_dot_is_seen_on_every_cell_of_a_map(dark):
    colours, style = scheme(dark), read_style()
    for level in range(13):
        fill = re.findall(rf"\.v{level} {{ fill: (.*); }}", style)[0]
        names, share = re.findall(r"--(q\d)", fill), re.findall(r"(\d+)%", fill)
        part = int(share[0]) / 100 if share else 1.0
        cell = part * colours[names[0]] + (1.0 - part) * colours[names[-1]]
        dot = colours["dot-on-strong" if is_strong(f"v{level}") else "dot"]
        assert contrast(dot, cell) >= LEAST, level
