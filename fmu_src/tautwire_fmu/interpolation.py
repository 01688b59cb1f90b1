"""How an input moves between two communication points, from its values and rates there."""

from typing import Tuple


def extrapolate(value: float, rate: float, curvature: float, elapsed: float) -> float:
    """The Taylor polynomial ``value + rate s + curvature s^2 / 2`` at ``s = elapsed``."""
    return value + elapsed * (rate + 0.5 * elapsed * curvature)


def cubic(start: float, start_rate: float, end: float, end_rate: float, step: float, fraction: float) -> float:
    """The Hermite cubic through value and rate at both ends, at ``fraction`` of the step (0 to 1)."""
    rest = 1.0 - fraction
    return rest * rest * ((1.0 + 2.0 * fraction) * start + fraction * step * start_rate) + fraction * fraction * (
        (1.0 + 2.0 * rest) * end - rest * step * end_rate
    )


def quintic(
    start: Tuple[float, float, float], end: Tuple[float, float, float], step: float, fraction: float
) -> Tuple[float, float]:
    """Value and rate of the quintic through value, rate and curvature at both ends.

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
    return value, slope / step
