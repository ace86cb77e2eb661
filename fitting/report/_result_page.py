"""A page of a result: a headline, facts, sections with a picture and a table. No script."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import jinja2
from markupsafe import Markup

from ._pages import PagePicture, load_template, read_style

Pairs = Sequence[tuple[str, str]]
_MORE = Markup(".plain td { white-space: normal; }")


@dataclasses.dataclass(frozen=True)
class Section:
    """One part of a page.

    - `shows`: what the reader should see, a sentence or two; beside the picture where there is one.
    - `heads`, `rows`: a table. `lines`: a list.
    """

    heading: str
    shows: str = ""
    picture: PagePicture | None = None
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    lines: Sequence[str] = ()


def render_result(
    *,
    title: str,
    headline: str,
    facts: Pairs,
    sections: Sequence[Section],
    provenance: Pairs,
    advice: str = "",
    cautions: Sequence[str] = (),
) -> str:
    """The page as one HTML file that needs nothing but itself; text is shown as text."""
    return _load_template().render(
        title=title,
        headline=headline,
        advice=advice,
        cautions=cautions,
        facts=facts,
        sections=sections,
        provenance=provenance,
        style=read_style(),
        more=_MORE,
    )


def list_versions(versions: dict[str, Any]) -> str:
    """Packages and their versions in one line."""
    return ", ".join(f"{name} {number}" for name, number in versions.items() if number)


@functools.cache
def _load_template() -> jinja2.Template:
    return load_template("fitting.report", "result.html")
