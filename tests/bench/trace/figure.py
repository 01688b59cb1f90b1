"""The confusion matrix as a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from .score import Scored, confusion

RIGHT, WRONG, OTHER = "#2a7f62", "#b3372f", "#8a8f98"
# Text stays text, and the file is the same for the same numbers.
PLAIN = {"svg.fonttype": "none", "svg.hashsalt": "tautwire"}
NO_DATE = {"Date": None}


def confusion_figure(answers: Sequence[Scored]) -> Figure:
    """Truth by rows, answer by columns: green where the answer is true, red where a name is false, grey otherwise."""
    rows, columns, counts = confusion(answers)
    truths = {answer.case.label: answer for answer in answers}
    figure = Figure(figsize=(2.6 + 0.36 * len(columns), 1.8 + 0.24 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for (row, column), count in np.ndenumerate(counts):
        if count:
            colour = _colour(truths[rows[row]], columns[column])
            axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, facecolor=colour))
            axes.text(column, row, str(count), ha="center", va="center", color="white", fontsize=8)
    axes.set(xlim=(-0.5, len(columns) - 0.5), ylim=(len(rows) - 0.5, -0.5))
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="left", rotation_mode="anchor", fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.xaxis.tick_top()
    axes.set_xlabel("said", fontsize=9)
    axes.set_ylabel("hidden", fontsize=9)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color="#d8dbe0", linewidth=0.6)
    axes.tick_params(which="both", length=0)
    return figure


def save(figure: Figure, path: str) -> None:
    """As SVG."""
    with rc_context(PLAIN):
        figure.savefig(path, format="svg", metadata=NO_DATE)


def _colour(truth: Scored, said: str) -> str:
    case = truth.case
    if said in case.names or (case.kind == "empty" and said == "none"):
        return RIGHT
    if case.kind == "unlisted" and said in ("unexplained", "discovered"):
        return RIGHT
    return OTHER if said in ("none", "unexplained", "discovered", "failed") else WRONG
