"""A page as a parser reads it: tags, attributes, text, scripts."""

import html.parser

VOID = {"meta", "link", "br", "img", "hr", "input", "source"}


class Page(html.parser.HTMLParser):
    """A page as tags, attributes and the text in each."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []  # the innermost tag or class, and its text
        self.scripts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open, f"never closed: {self._open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open and self._open[-1] == tag, f"</{tag}> closes {self._open[-3:]}"
        self._open.pop()

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "script":
            self.scripts.append(data)
        elif "body" in self._open and data.strip():
            self.texts.append((self._open[-1], " ".join(data.split())))

    @property
    def text(self) -> str:
        """All that a reader can read."""
        return " ".join(text for _, text in self.texts)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """Attributes of every element of one kind."""
        return [attributes for name, attributes in self.tags if name == tag]


def spaced(text: str) -> str:
    """Text with plain spaces, as `Page.text` has it."""
    return " ".join(text.split())
