"""How `--help` looks: paragraphs filled to the width of the terminal, not as in the source."""

import inspect
from typing import Any

from cyclopts.help import DefaultFormatter, HelpPanel


def fill(text: str) -> str:
    """`text` with the lines of each paragraph joined; indented ones (examples) stay as they are."""
    paragraphs = text.strip("\n").split("\n\n")
    return "\n\n".join(
        paragraph if paragraph.startswith(" ") else " ".join(paragraph.split())
        for paragraph in paragraphs
    )


def description(function: Any) -> str:
    """What the docstring of a command says before it lists the arguments."""
    text = inspect.getdoc(function) or ""
    return fill(text.split("Parameters\n----------")[0])


class FilledHelp(DefaultFormatter):
    """The ordinary panels, with filled paragraphs."""

    def __call__(self, console: Any, options: Any, panel: HelpPanel) -> None:
        """Draw one panel."""
        for entry in panel.entries:
            _fill(entry.description)
        super().__call__(console, options, panel)

    def render_description(self, console: Any, options: Any, description: Any) -> None:
        """Draw the text above the panels."""
        _fill(description)
        super().render_description(console, options, description)


def _fill(renderable: Any) -> None:
    """Fill the text that an entry of a help page begins with."""
    from rich.text import Text

    text = getattr(renderable, "primary_renderable", None)
    if isinstance(text, Text) and "\n" in text.plain:
        renderable.primary_renderable = Text(fill(text.plain))
