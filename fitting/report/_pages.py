"""What all pages share: templates with escaping on, and the style sheet."""

import functools
from importlib import resources

import jinja2
from markupsafe import Markup


def load_template(package: str, name: str) -> jinja2.Template:
    """The template `name` of a report's package; `figures.html` of this one can be imported."""
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [jinja2.PackageLoader(package), jinja2.PackageLoader("fitting.report")]
        ),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    return environment.get_template(name)


@functools.cache
def read_style() -> Markup:
    """The style of all pages, and that of their charts."""
    return _read_asset("page.css") + _read_asset("charts.css")


def _read_asset(name: str) -> Markup:
    file = resources.files("fitting.report").joinpath("templates", name)
    return Markup(file.read_text("utf-8"))  # noqa: S704
