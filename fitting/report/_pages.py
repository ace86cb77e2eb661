"""What all pages share: templates with escaping on, the style sheet, the figures' script."""

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
    # NaN is not JSON: better no page than one whose script fails.
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False}
    return environment.get_template(name)


@functools.cache
def read_style() -> Markup:
    """The style of all pages."""
    return _read_asset("page.css")


@functools.cache
def read_script() -> Markup:
    """The script that draws a page's figures, in the colours of its style."""
    return _read_asset("figures.js")


@functools.cache
def load_plotly() -> Markup:
    """plotly.js, safe within a script element."""
    from plotly.offline import get_plotlyjs

    # Within a script element these would end it.
    text = get_plotlyjs().replace("</script", r"<\/script").replace("<!--", r"<\!--")
    return Markup(text)  # noqa: S704


def _read_asset(name: str) -> Markup:
    file = resources.files("fitting.report").joinpath("templates", name)
    return Markup(file.read_text("utf-8"))  # noqa: S704
