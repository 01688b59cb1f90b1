"""The common style of all figures of the paper, and how they are written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib import rcsetup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

# Legible on white and on the page's dark background, where the page's own text colour replaces this one.
TEXT_COLOUR, BACKGROUND_COLOUR, GRID_COLOUR = "#1c2328", "#ffffff", "#8f9aa2"
LINE_COLOURS = ("#1f7fa6", "#c8782f", "#7a5ba8", "#2f8a5b")
PANEL_WIDTH, PANEL_HEIGHT = 3.3, 2.35  # inches, of one panel
DOTS_PER_INCH = 150

MATPLOTLIB_SETTINGS: Any = {
    "figure.facecolor": BACKGROUND_COLOUR,
    "axes.facecolor": BACKGROUND_COLOUR,
    "savefig.facecolor": BACKGROUND_COLOUR,
    "text.color": TEXT_COLOUR,
    "axes.edgecolor": GRID_COLOUR,
    "axes.labelcolor": TEXT_COLOUR,
    "axes.titlecolor": TEXT_COLOUR,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.prop_cycle": rcsetup.cycler("color", LINE_COLOURS),
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    "grid.color": GRID_COLOUR,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "xtick.color": TEXT_COLOUR,
    "ytick.color": TEXT_COLOUR,
    "lines.linewidth": 1.4,
    "font.size": 9.0,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "path.simplify_threshold": 0.4,
    "svg.fonttype": "none",
}


@dataclass(frozen=True)
class PaperFigure:
    """A figure: ``name`` as in ``fig_07``, ``title``, and ``description``, its text alternative."""

    name: str
    title: str
    description: str
    figure: Figure


@contextmanager
def figure_style() -> Iterator[None]:
    """The figure style as a context in which figures are made and written."""
    with mpl.rc_context(MATPLOTLIB_SETTINGS):
        yield


def panel_grid(count: int, columns: int) -> tuple[Figure, list[Axes]]:
    """A figure of equal panels, row by row."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(PANEL_WIDTH * columns, PANEL_HEIGHT * rows + 0.35), layout="constrained")
    axes = [figure.add_subplot(rows, columns, index + 1) for index in range(count)]
    return figure, axes


def label_panel(axes: Axes, label: str, title: str, x_label: str = "Time (s)") -> None:
    """Label both axes of a panel, and put its title above on the left."""
    axes.set(xlabel=x_label, ylabel=label)
    axes.set_title(title, loc="left", fontsize="medium")


def legend_above(figure: Figure, axes: Axes) -> None:
    """Place one legend for all panels above them; none where no curve has a label."""
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))


def figure_table(figure: Figure) -> pd.DataFrame:
    """The curves of a figure as columns, of each panel and curve one for each axis; blank behind the shorter ones.

    Curves of a panel share the column of their abscissa where it is the same; lines that only guide the eye are none.
    """
    columns: dict[str, np.ndarray[Any, Any]] = {}
    for index, axes in enumerate(figure.axes, start=1):
        unnamed = f"panel {index}" if len(figure.axes) > 1 else ""
        panel, names = axes.get_title(loc="left") or axes.get_title() or unnamed, _axis_names(axes)
        for number, line in enumerate((line for line in axes.lines if _is_curve(axes, line)), start=1):
            label = str(line.get_label())
            curve = f"curve {number}" if label.startswith("_") else plain_label(label)
            for axis, values in zip(names, _coordinates(line), strict=True):
                shared, own = (": ".join(filter(None, (panel, *parts))) for parts in ((axis,), (curve, axis)))
                if axis != names[0] or not np.array_equal(columns.setdefault(shared, values), values):
                    columns[own] = values
    return pd.DataFrame({name: pd.Series(values) for name, values in columns.items()})


def _axis_names(axes: Axes) -> tuple[str, ...]:
    labels = [axes.get_xlabel() or "x", axes.get_ylabel() or "y"]
    labels += [axes.get_zlabel() or "z"] if hasattr(axes, "get_zlabel") else []
    return tuple(map(plain_label, labels))


def plain_label(label: str) -> str:
    """A label without its mathematical markup."""
    return label.replace("$", "").replace("\\Delta", "error").replace("_", " ").replace("\\dot", "rate of")


def _is_curve(axes: Axes, line: Line2D) -> bool:
    """Whether a line has data on both axes, not a place on one of them alone."""
    return hasattr(line, "get_data_3d") or line.get_transform() == axes.transData


def _coordinates(line: Line2D) -> tuple[np.ndarray[Any, Any], ...]:
    data = line.get_data_3d() if hasattr(line, "get_data_3d") else line.get_data()
    return tuple(np.asarray(values, dtype=float) for values in data)


def write_figures(
    figures: Sequence[PaperFigure], folder: Path, progress: Callable[[float], None] = lambda done: None
) -> dict[str, str]:
    """Write each figure as PNG, SVG, and its curves as CSV; returns the SVG texts by name.

    ``progress`` receives the share that is done.
    """
    texts = {}
    for index, drawn in enumerate(figures):
        progress(index / len(figures))
        # The ids inside an SVG are derived from this; two figures on one page must not share any.
        with mpl.rc_context({"svg.hashsalt": drawn.name}):
            drawn.figure.savefig(folder / f"{drawn.name}.png", dpi=DOTS_PER_INCH)
            drawn.figure.savefig(folder / f"{drawn.name}.svg", metadata={"Date": None})
        figure_table(drawn.figure).to_csv(folder / f"{drawn.name}.csv", index=False, float_format="%.7g")
        texts[drawn.name] = (folder / f"{drawn.name}.svg").read_text(encoding="utf-8")
    return texts
