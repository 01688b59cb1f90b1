"""One look for all figures, and how one is written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib import rcsetup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Readable on white and on the page's dark ground; the ink gives way to the page's text colour there.
INK, PAPER, RULE = "#1c2328", "#ffffff", "#8f9aa2"
COLOURS = ("#1f7fa6", "#c8782f", "#7a5ba8", "#2f8a5b")
WIDTH, HEIGHT = 3.3, 2.35  # inches, of one panel
DOTS = 150

SETTINGS: Any = {
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "text.color": INK,
    "axes.edgecolor": RULE,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.prop_cycle": rcsetup.cycler("color", COLOURS),
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    "grid.color": RULE,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "lines.linewidth": 1.4,
    "font.size": 9.0,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "path.simplify_threshold": 0.4,
    "svg.fonttype": "none",
}


@dataclass(frozen=True)
class Drawn:
    """A figure: ``name`` as in ``fig_07``, ``title``, and ``told``, what it shows for those who do not see it."""

    name: str
    title: str
    told: str
    figure: Figure


@contextmanager
def style() -> Iterator[None]:
    """The look, while figures are made and written."""
    with mpl.rc_context(SETTINGS):
        yield


def panel_grid(count: int, columns: int) -> tuple[Figure, list[Axes]]:
    """A figure of equal panels, row by row."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(WIDTH * columns, HEIGHT * rows + 0.35), layout="constrained")
    axes = [figure.add_subplot(rows, columns, place + 1) for place in range(count)]
    return figure, axes


def legend_above(figure: Figure, axes: Axes) -> None:
    """One legend for all panels, above them; none where nothing is named."""
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))


def write_figures(
    drawn: Sequence[Drawn], folder: Path, progress: Callable[[float], None] = lambda done: None
) -> dict[str, str]:
    """Write each figure as PNG and SVG; returns the SVG texts by name. ``progress`` hears of the share that is done."""
    texts = {}
    for place, each in enumerate(drawn):
        progress(place / len(drawn))
        # Names inside an SVG are made from this; two on one page must not share any.
        with mpl.rc_context({"svg.hashsalt": each.name}):
            each.figure.savefig(folder / f"{each.name}.png", dpi=DOTS)
            each.figure.savefig(folder / f"{each.name}.svg", metadata={"Date": None})
        texts[each.name] = (folder / f"{each.name}.svg").read_text(encoding="utf-8")
    return texts
