"""How an input moves between two communication points, from its values and rates there."""

from typing import Sequence, Tuple


def extrapolate(value: float, rate: float, curvature: float, elapsed: float) -> float:
    """The Taylor polynomial ``value + rate s + curvature s^2 / 2`` at ``s = elapsed``."""
    return value + elapsed * (rate + 0.5 * elapsed * curvature)


def cubic(start: Sequence[float], end: Sequence[float], step: float, fraction: float) -> Tuple[float, float]:
    """Value and rate of the Hermite cubic through (value, rate) at both ends, at ``fraction`` of the step (0 to 1)."""
    (x0, v0), (x1, v1) = start, end
    gap, slope0, slope1 = x1 - x0, step * v0, step * v1
    c2 = 3.0 * gap - 2.0 * slope0 - slope1
    c3 = slope0 + slope1 - 2.0 * gap
    f = fraction
    return x0 + f * (slope0 + f * (c2 + f * c3)), (slope0 + f * (2.0 * c2 + 3.0 * f * c3)) / step


def quintic(start: Sequence[float], end: Sequence[float], step: float, fraction: float) -> Tuple[float, float, float]:
    """Value, rate and curvature of the quintic through value, rate and curvature at both ends.

    ``start`` and ``end`` are (value, rate, curvature); the fraction runs from 0 to 1.
    """
    x0, v0, a0 = start
    x1, v1, a1 = end
    half_square = 0.5 * step * step
    gap = x1 - x0 - step * v0 - half_square * a0
    gap_rate = step * (v1 - v0) - 2.0 * half_square * a0
    gap_curvature = half_square * (a1 - a0)
    c3 = 10.0 * gap - 4.0 * gap_rate + gap_curvature
    c4 = -15.0 * gap + 7.0 * gap_rate - 2.0 * gap_curvature
    c5 = 6.0 * gap - 3.0 * gap_rate + gap_curvature
    f = fraction
    value = x0 + f * (step * v0 + f * (half_square * a0 + f * (c3 + f * (c4 + f * c5))))
    slope = step * v0 + f * (2.0 * half_square * a0 + f * (3.0 * c3 + f * (4.0 * c4 + f * 5.0 * c5)))
    bend = 2.0 * half_square * a0 + f * (6.0 * c3 + f * (12.0 * c4 + f * 20.0 * c5))
    return value, slope / step, bend / (step * step)
