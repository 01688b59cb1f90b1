"""Geometry of inline charts for table cells; the numbers beside them say the same, so screen readers skip them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

WIDTH, MARGIN = 200.0, 6.0


@dataclass(frozen=True)
class Mark:
    """A mark of a chart in a CSS class: a dot or tick at ``start``, or a line or bar from it to ``end`` (px)."""

    shape: str
    css_class: str
    start: float
    end: float = 0.0


@dataclass(frozen=True)
class Chart:
    """A chart as a table cell: its marks from back to front; without marks the cell is empty."""

    marks: tuple[Mark, ...] = ()
    kind: str = field(default="chart", init=False)


def dumbbell(before: float, after: float, noise_floor: float, low: float, high: float) -> Chart:
    """Dumbbell chart: error before and after on a logarithmic scale from ``low`` to ``high``, noise floor as a tick."""
    drawn = {name: value for name, value in (("before", before), ("after", after)) if _is_positive(value)}
    if not drawn or not 0.0 < low < high:
        return Chart()
    marks = [Mark("tick", "floor", _log_position(noise_floor, low, high))] if _is_positive(noise_floor) else []
    positions = {name: _log_position(value, low, high) for name, value in drawn.items()}
    if len(positions) == 2:
        marks.append(Mark("line", "span", *positions.values()))
    return Chart((*marks, *(Mark("dot", name, position) for name, position in positions.items())))


def bar(value: float, largest: float, tick: float | None = None, css_class: str = "after") -> Chart:
    """A bar from zero to a value, nothing where it is negative; ``tick`` is the value of a line across it."""
    if not math.isfinite(value) or not largest > 0.0:
        return Chart()
    span = WIDTH - 2 * MARGIN
    length = span * max(0.0, min(1.0, value / largest))
    marks = (Mark("bar", css_class, MARGIN, MARGIN + max(length, 1.0)),)
    return Chart(marks if tick is None else (*marks, Mark("tick", "floor", MARGIN + span * min(1.0, tick / largest))))


def log_bar(value: float, low: float, high: float, tick: float, css_class: str = "after") -> Chart:
    """A bar from ``tick``, marked by a line, to a value on a logarithmic scale from ``low`` to ``high``."""
    if not _is_positive(value) or not 0.0 < low < high:
        return Chart()
    x = _log_position(tick, low, high)
    left, right = sorted((x, _log_position(value, low, high)))
    return Chart((Mark("bar", css_class, left, max(right, left + 1.0)), Mark("tick", "floor", x)))


def whisker(value: float, low: float, high: float, declared: float | None) -> Chart:
    """A confidence interval with its estimate, and the declared value as a tick, on a linear scale."""
    points = [point for point in (value, low, high, declared) if point is not None and math.isfinite(point)]
    if len(points) < 2 or max(points) == min(points):
        return Chart()
    left, right = min(points), max(points)

    def position(point: float) -> float:
        return MARGIN + (WIDTH - 2 * MARGIN) * (point - left) / (right - left)

    marks = []
    if declared is not None and math.isfinite(declared):
        marks.append(Mark("tick", "declared", position(declared)))
    if math.isfinite(low) and math.isfinite(high):
        marks.append(Mark("line", "interval", position(low), position(high)))
    if math.isfinite(value):
        marks.append(Mark("dot", "after", position(value)))
    return Chart(tuple(marks))


def _log_position(value: float, low: float, high: float) -> float:
    fraction = math.log(value / low) / math.log(high / low)
    return MARGIN + (WIDTH - 2 * MARGIN) * max(0.0, min(1.0, fraction))


def _is_positive(value: float) -> bool:
    return math.isfinite(value) and value > 0.0
