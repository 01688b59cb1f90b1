"""What a page holds, for tests that read pages without a browser."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from typing import Any

MAX_PAGE_BYTES = 1_500_000
VOID = {"meta", "input", "img", "br", "link", "hr"}
# Attributes that fetch what they name.
FETCHING = {"src", "srcset", "poster", "data", "action", "background"}


class Page(HTMLParser):
    """What a page holds: elements with attributes, text, and the content of each script."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.scripts: list[str] = []
        self.text = ""
        self.feed(content)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attributes}))
        if tag == "script":
            self.scripts.append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attributes}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += data
        elif "style" not in self.open:
            self.text += data

    def all(self, tag: str) -> list[dict[str, str]]:
        """Attributes of all elements of a kind."""
        return [attributes for name, attributes in self.elements if name == tag]

    def links(self) -> list[str]:
        """Targets of all links to something outside the page."""
        return [each["href"] for each in self.all("a") if not each["href"].startswith("#")]

    def data(self) -> dict[str, Any]:
        """What the figures draw."""
        result: dict[str, Any] = json.loads(self.scripts[0])
        return result


def section_of(content: str, identity: str) -> Page:
    """One section of a page."""
    start = content.index(f'<section id="{identity}"')
    return Page(content[start : content.index("</section>", start)] + "</section>")
