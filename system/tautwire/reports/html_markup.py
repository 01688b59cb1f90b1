"""HTML of all pages: escaped text, tables, sections, grids of figure panels, and the self-contained page."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from typing import Any
from urllib.parse import quote

from ..errors import one_line

# Sign and digits of the exponent in a number such as 1.5e-08.
EXPONENT_PATTERN = re.compile(r"(?<=\d)e([+-])0*(\d+)\b")
# Written as escapes, these cannot end a script element or a line of JavaScript.
UNSAFE_IN_SCRIPT = {character: f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"}


@dataclass(frozen=True)
class TableColumn:
    """A column of an HTML table; numbers are right-aligned, and ``wide`` cells span the width of a narrow screen."""

    title: str
    numeric: bool = False
    wide: bool = False


def escape_text(value: str) -> str:
    """Escapes a text for HTML."""
    return html.escape(one_line(value), quote=True)


def number_html(value: str) -> str:
    """A formatted number as HTML, with a true minus sign and powers of ten, and a dash for an absent one."""
    if value == "-":
        return '<span class="absent" aria-label="none">&ndash;</span>'
    typeset = EXPONENT_PATTERN.sub(r"&nbsp;&times;&nbsp;10<sup>\1\2</sup>", escape_text(value)).replace(
        "<sup>+", "<sup>"
    )
    return typeset.replace("-", "&minus;").replace(" %", "&nbsp;%")


def href(target: str) -> str:
    """A relative path, escaped as the value of href; whatever it contains, it stays relative to the page."""
    return html.escape(quote(one_line(target), safe="/._-~"), quote=True)


def download_links(links: Mapping[str, str]) -> str:
    """Download links to files beside the page, by label; empty where there are none."""
    anchors = "".join(
        f'<li><a href="{href(target)}" download>{escape_text(label)}</a></li>' for label, target in links.items()
    )
    return f'<nav class="files" aria-label="Downloads"><span>Download</span><ul>{anchors}</ul></nav>' if anchors else ""


def inline_json(value: Any) -> str:
    """JSON escaped for a script element."""
    json_text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return "".join(UNSAFE_IN_SCRIPT.get(character, character) for character in json_text)


def table(
    caption: str,
    columns: Sequence[TableColumn],
    rows: Sequence[Sequence[str]],
    css_class: str = "",
    caption_hidden: bool = False,
) -> str:
    """An HTML table that scrolls sideways where it is too wide; the first cell of a row is its header.

    ``rows`` hold HTML; with ``caption_hidden`` only screen readers get the caption.
    """
    hidden = ' class="quiet"' if caption_hidden else ""
    heads = "".join(
        f'<th scope="col" role="columnheader"{_cell_class(column)}>{escape_text(column.title)}</th>'
        for column in columns
    )
    body = "".join(_row_html(columns, row) for row in rows)
    return (
        f'<div class="scroll" role="region" aria-label="{escape_text(caption)}" tabindex="0">'
        f'<table class="{escape_text(css_class)}" role="table"><caption{hidden}>{escape_text(caption)}</caption>'
        f'<thead role="rowgroup"><tr role="row">{heads}</tr></thead><tbody role="rowgroup">{body}</tbody></table></div>'
    )


def section(element_id: str, title: str, content: str, lead: str = "") -> str:
    """An HTML section with a heading; ``lead`` and ``content`` are HTML."""
    introduction = f'<p class="lead">{lead}</p>' if lead else ""
    return (
        f'<section id="{element_id}" aria-labelledby="{element_id}-title">'
        f'<h2 id="{element_id}-title">{escape_text(title)}</h2>{introduction}{content}</section>'
    )


def bullet_list(lines: Sequence[str]) -> str:
    """An HTML list of texts, which are escaped here."""
    return "<ul>" + "".join(f"<li>{escape_text(line)}</li>" for line in lines) + "</ul>"


def _row_html(columns: Sequence[TableColumn], cells: Sequence[str]) -> str:
    """A row; a narrow screen stacks its cells, each with its column's title before it."""
    first = f'<th scope="row" role="rowheader"{_cell_class(columns[0])}>{cells[0]}</th>'
    cells_html = "".join(
        f'<td role="cell" data-title="{escape_text(column.title)}"{_cell_class(column)}>{cell}</td>'
        for column, cell in zip(columns[1:], cells[1:], strict=True)
    )
    return f'<tr role="row">{first}{cells_html}</tr>'


def _cell_class(column: TableColumn) -> str:
    names = [name for name, applies in (("number", column.numeric), ("wide", column.wide)) if applies]
    return f' class="{" ".join(names)}"' if names else ""


def panel_groups(kind: str, groups: Mapping[str, Sequence[tuple[int, str]]], description: str) -> str:
    """Groups of empty panels under headings, each panel given by its channel's index in the data and its label.

    ``kind`` is a key of ``panelKinds`` in the scripts; ``description`` labels the panels until the scripts replace it.
    """
    return "".join(
        f"<h3>{escape_text(title)}</h3><div "
        f'class="panels">{"".join(_panel_html(kind, *each, description) for each in group)}</div>'
        for title, group in groups.items()
        if group
    )


def _panel_html(kind: str, channel_index: int, label: str, description: str) -> str:
    """An empty figure; scripts fill its caption and label."""
    return (
        f'<figure class="panel" data-kind="{kind}" '
        f'data-channel="{channel_index}"><figcaption><strong>{escape_text(label)}'
        '</strong> <span class="numbers"></span></figcaption>'
        f'<div class="plot" role="img" aria-label="{escape_text(f"{description} of {label}")}"></div></figure>'
    )


# The order matters: later scripts use what earlier ones define.
FIGURE_SCRIPTS = ("drawing.js", "panels.js", "flat.js", "scene.js", "controls.js")


def html_page(title: str, body: str, figures: Any = None, scripts: Sequence[str] = ()) -> str:
    """A complete HTML page: ``title`` is plain text, ``body`` the HTML inside ``main``.

    With ``figures``, any JSON value, plotly and the scripts that draw them are included: the shared ones, then
    ``scripts`` by their names in ``assets``. The page opens from a disk, without a network.
    """
    return Template(asset("page.html")).substitute(
        title=escape_text(title), style=asset("style.css"), body=body, figures=_figure_scripts(figures, scripts)
    )


def asset(name: str) -> str:
    """The text of a file in ``assets``."""
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


def _figure_scripts(figures: Any, scripts: Sequence[str]) -> str:
    """The script elements of a page with figures; the first holds the data."""
    if figures is None:
        return ""
    # Imported here: plotly takes long to import, and only pages need it.
    from plotly.offline import get_plotlyjs

    names = [*FIGURE_SCRIPTS, *scripts, "start.js"]
    script_text = "\n".join(asset(name) for name in names)
    data = f'<script type="application/json" id="report-data">{inline_json(figures)}</script>'
    return f"{data}\n<script>{get_plotlyjs()}</script>\n<script>\n{script_text}\n</script>"
