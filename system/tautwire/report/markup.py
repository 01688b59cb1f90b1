"""Small pieces of HTML; every text that comes from a file goes through :func:`text` or :func:`inline_json`."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from ..errors import one_line

# Written as escapes, these cannot end a script element or a line of JavaScript.
UNSAFE_IN_SCRIPT = {character: f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"}


@dataclass(frozen=True)
class Column:
    """A column of a table; numbers are set to the right in figures of equal width."""

    title: str
    numeric: bool = False


def text(value: str) -> str:
    """A text as HTML that shows it and nothing else."""
    return html.escape(one_line(value), quote=True)


def number(value: str) -> str:
    """A formatted number as HTML, with a true minus sign and a dash where there is none."""
    if value == "-":
        return '<span class="absent" aria-label="none">&ndash;</span>'
    return text(value).replace("-", "&minus;").replace(" %", "&nbsp;%")


def href(target: str) -> str:
    """A relative path as the value of href; whatever it contains, it stays a path beside the page."""
    return html.escape(quote(one_line(target), safe="/._-~"), quote=True)


def inline_json(value: Any) -> str:
    """JSON that may stand inside a script element."""
    plain = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return "".join(UNSAFE_IN_SCRIPT.get(character, character) for character in plain)


def table(
    caption: str, columns: Sequence[Column], rows: Sequence[Sequence[str]], name: str = "", quiet: bool = False
) -> str:
    """A table that scrolls sideways on its own where it is too wide; the first cell of a row is its header.

    ``rows`` hold HTML; a ``quiet`` caption is for readers that do not see the heading above.
    """
    hidden = ' class="quiet"' if quiet else ""
    heads = "".join(f'<th scope="col"{_kind(column)}>{text(column.title)}</th>' for column in columns)
    body = "".join(_row(columns, row) for row in rows)
    return (
        f'<div class="scroll" role="region" aria-label="{text(caption)}" tabindex="0">'
        f'<table class="{text(name)}"><caption{hidden}>{text(caption)}</caption>'
        f"<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def section(identity: str, title: str, content: str, lead: str = "") -> str:
    """A section with a heading; ``lead`` and ``content`` are HTML."""
    introduction = f'<p class="lead">{lead}</p>' if lead else ""
    return (
        f'<section id="{identity}" aria-labelledby="{identity}-title">'
        f'<h2 id="{identity}-title">{text(title)}</h2>{introduction}{content}</section>'
    )


def bullets(lines: Sequence[str]) -> str:
    """A list of texts, escaped here."""
    return "<ul>" + "".join(f"<li>{text(line)}</li>" for line in lines) + "</ul>"


def _row(columns: Sequence[Column], cells: Sequence[str]) -> str:
    first = f'<th scope="row"{_kind(columns[0])}>{cells[0]}</th>'
    rest = "".join(f"<td{_kind(column)}>{cell}</td>" for column, cell in zip(columns[1:], cells[1:], strict=True))
    return f"<tr>{first}{rest}</tr>"


def _kind(column: Column) -> str:
    return ' class="number"' if column.numeric else ""
