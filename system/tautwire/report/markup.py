"""Small pieces of HTML; every text that comes from a file goes through :func:`text` or :func:`inline_json`."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from ..errors import one_line

# Sign and digits of the power of ten in a number such as 1.5e-08.
POWER = re.compile(r"(?<=\d)e([+-])0*(\d+)\b")
# Written as escapes, these cannot end a script element or a line of JavaScript.
UNSAFE_IN_SCRIPT = {character: f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"}


@dataclass(frozen=True)
class Column:
    """A column of a table; numbers are set to the right, and ``wide`` cells have a narrow screen's whole width."""

    title: str
    numeric: bool = False
    wide: bool = False


def text(value: str) -> str:
    """A text as HTML that shows it and nothing else."""
    return html.escape(one_line(value), quote=True)


def number(value: str) -> str:
    """A formatted number as HTML, with a true minus sign and powers of ten, and a dash where there is none."""
    if value == "-":
        return '<span class="absent" aria-label="none">&ndash;</span>'
    typeset = POWER.sub(r"&nbsp;&times;&nbsp;10<sup>\1\2</sup>", text(value)).replace("<sup>+", "<sup>")
    return typeset.replace("-", "&minus;").replace(" %", "&nbsp;%")


def href(target: str) -> str:
    """A relative path as the value of href; whatever it contains, it stays a path beside the page."""
    return html.escape(quote(one_line(target), safe="/._-~"), quote=True)


def downloads(links: Mapping[str, str]) -> str:
    """Links to the files beside the page, by their labels; empty where there are none."""
    anchors = "".join(
        f'<li><a href="{href(target)}" download>{text(label)}</a></li>' for label, target in links.items()
    )
    return f'<nav class="files" aria-label="Downloads"><span>Download</span><ul>{anchors}</ul></nav>' if anchors else ""


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
    heads = "".join(
        f'<th scope="col" role="columnheader"{_kind(column)}>{text(column.title)}</th>' for column in columns
    )
    body = "".join(_row(columns, row) for row in rows)
    return (
        f'<div class="scroll" role="region" aria-label="{text(caption)}" tabindex="0">'
        f'<table class="{text(name)}" role="table"><caption{hidden}>{text(caption)}</caption>'
        f'<thead role="rowgroup"><tr role="row">{heads}</tr></thead><tbody role="rowgroup">{body}</tbody></table></div>'
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
    """A row; a narrow screen stacks its cells, each with its column's title before it."""
    first = f'<th scope="row" role="rowheader"{_kind(columns[0])}>{cells[0]}</th>'
    rest = "".join(
        f'<td role="cell" data-title="{text(column.title)}"{_kind(column)}>{cell}</td>'
        for column, cell in zip(columns[1:], cells[1:], strict=True)
    )
    return f'<tr role="row">{first}{rest}</tr>'


def _kind(column: Column) -> str:
    names = [name for name, holds in (("number", column.numeric), ("wide", column.wide)) if holds]
    return f' class="{" ".join(names)}"' if names else ""
