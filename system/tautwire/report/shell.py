"""The self-contained HTML page that all reports share, with its style, data and scripts inside."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from string import Template
from typing import Any

from .markup import escape_text, inline_json

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
