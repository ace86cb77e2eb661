"""What all pages share: templates with escaping on, and the style sheet."""

import base64
import dataclasses
import functools
from importlib import resources
from typing import Any

import jinja2
from markupsafe import Markup

from rapi_jax.internal import typeset

WIDE_DPI = 80  # keeps a page of twelve runs below 1 MB
NARROW_DPI = 110  # where it is 4.8 inches wide, on screens with fine dots


@dataclasses.dataclass(frozen=True)
class PagePicture:
    """A picture as PNG in base 64: for wide pages, and for narrow ones."""

    wide: str
    narrow: str

    @classmethod
    def of(cls, figure: Any) -> "PagePicture":
        """A figure of `rapi_jax.plot`, which is narrow afterwards."""
        from rapi_jax import plot

        wide = plot.png(figure, dpi=WIDE_DPI)
        narrow = plot.png(plot.narrowed(figure), dpi=NARROW_DPI)
        return cls(*(base64.b64encode(data).decode() for data in (wide, narrow)))


def load_template(package: str, name: str) -> jinja2.Template:
    """The template `name` of a report's package; `figures.html` of this one can be imported.

    Its filter `typeset` sets units and numbers in a text.
    """
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [jinja2.PackageLoader(package), jinja2.PackageLoader("fitting.report")]
        ),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["typeset"] = _typeset
    return environment.get_template(name)


def _typeset(text: Any) -> Any:
    """Text as `typeset` sets it; a dash where there is no value; markup as it is."""
    if isinstance(text, Markup) or not isinstance(text, str):
        return text
    return "\N{EN DASH}" if text == "-" else typeset(text)


@functools.cache
def read_style() -> Markup:
    """The style of all pages, and that of their charts."""
    return _read_asset("page.css") + _read_asset("charts.css")


def _read_asset(name: str) -> Markup:
    file = resources.files("fitting.report").joinpath("templates", name)
    return Markup(file.read_text("utf-8"))  # noqa: S704
