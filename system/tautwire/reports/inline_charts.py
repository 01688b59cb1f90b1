"""Inline SVG charts for table cells; the numbers beside them say the same, so screen readers skip them."""

from __future__ import annotations

import math

WIDTH, HEIGHT, MARGIN = 200.0, 18.0, 6.0


def dumbbell(before: float, after: float, noise_floor: float, low: float, high: float) -> str:
    """Dumbbell chart: error before and after on a logarithmic scale from ``low`` to ``high``, noise floor as a tick."""
    drawn = [value for value in (before, after) if _is_positive(value)]
    if not drawn or not 0.0 < low < high:
        return ""
    marks = ""
    if _is_positive(noise_floor):
        x = _log_position(noise_floor, low, high)
        marks += f'<line class="floor" x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{HEIGHT:.0f}"/>'
    if len(drawn) == 2:
        ends = [_log_position(value, low, high) for value in drawn]
        marks += f'<line class="span" x1="{ends[0]:.1f}" x2="{ends[1]:.1f}" y1="9" y2="9"/>'
    for name, value in (("before", before), ("after", after)):
        if _is_positive(value):
            marks += f'<circle class="{name}" cx="{_log_position(value, low, high):.1f}" cy="9" r="4.5"/>'
    return _svg(marks)


def bar(value: float, largest: float, tick: float | None = None, css_class: str = "after") -> str:
    """A bar from zero to a value, nothing where it is negative; ``tick`` is the value of a line across it."""
    if not math.isfinite(value) or not largest > 0.0:
        return ""
    span = WIDTH - 2 * MARGIN
    length = span * max(0.0, min(1.0, value / largest))
    marks = f'<rect class="{css_class}" x="{MARGIN}" y="5" width="{max(length, 1.0):.1f}" height="8" rx="1.5"/>'
    if tick is not None:
        x = MARGIN + span * min(1.0, tick / largest)
        marks += f'<line class="floor" x1="{x:.1f}" x2="{x:.1f}" y1="1" y2="{HEIGHT - 1:.0f}"/>'
    return _svg(marks)


def log_bar(value: float, low: float, high: float, tick: float, css_class: str = "after") -> str:
    """A bar from ``tick``, marked by a line, to a value on a logarithmic scale from ``low`` to ``high``."""
    if not _is_positive(value) or not 0.0 < low < high:
        return ""
    x = _log_position(tick, low, high)
    left, right = sorted((x, _log_position(value, low, high)))
    marks = f'<rect class="{css_class}" x="{left:.1f}" y="5" width="{max(right - left, 1.0):.1f}" height="8" rx="1.5"/>'
    marks += f'<line class="floor" x1="{x:.1f}" x2="{x:.1f}" y1="1" y2="{HEIGHT - 1:.0f}"/>'
    return _svg(marks)


def whisker(value: float, low: float, high: float, declared: float | None) -> str:
    """A confidence interval with its estimate, and the declared value as a tick, on a linear scale."""
    points = [point for point in (value, low, high, declared) if point is not None and math.isfinite(point)]
    if len(points) < 2 or max(points) == min(points):
        return ""
    left, right = min(points), max(points)

    def position(point: float) -> float:
        return MARGIN + (WIDTH - 2 * MARGIN) * (point - left) / (right - left)

    marks = ""
    if declared is not None and math.isfinite(declared):
        x = position(declared)
        marks += f'<line class="declared" x1="{x:.1f}" x2="{x:.1f}" y1="2" y2="{HEIGHT - 2:.0f}"/>'
    if math.isfinite(low) and math.isfinite(high):
        marks += f'<line class="interval" x1="{position(low):.1f}" x2="{position(high):.1f}" y1="9" y2="9"/>'
    if math.isfinite(value):
        marks += f'<circle class="after" cx="{position(value):.1f}" cy="9" r="4"/>'
    return _svg(marks)


def _svg(marks: str) -> str:
    size = f'width="{WIDTH:.0f}" height="{HEIGHT:.0f}" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}"'
    return f'<svg class="chart" {size} aria-hidden="true" focusable="false">{marks}</svg>'


def _log_position(value: float, low: float, high: float) -> float:
    fraction = math.log(value / low) / math.log(high / low)
    return MARGIN + (WIDTH - 2 * MARGIN) * max(0.0, min(1.0, fraction))


def _is_positive(value: float) -> bool:
    return math.isfinite(value) and value > 0.0
