"""What is shown on a terminal, as plain text."""

import io

from rich.console import Console, RenderableType


def plain_text(shown: RenderableType) -> str:
    """The same 110 characters wide, without colours, wherever it is called."""
    buffer = io.StringIO()
    # Without `force_jupyter` rich would show it in a notebook's cell and leave the text empty.
    console = Console(
        file=buffer, width=110, color_system=None, highlight=False, force_jupyter=False
    )
    console.print(shown)
    return buffer.getvalue()
