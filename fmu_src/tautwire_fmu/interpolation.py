"""Hermite interpolation of an input between two communication points, from its values and rates there."""

from typing import Sequence, Tuple


def taylor_extrapolate(value: float, rate: float, curvature: float, elapsed: float) -> float:
    """The Taylor polynomial ``value + rate s + curvature s^2 / 2`` at ``s = elapsed``."""
    return value + elapsed * (rate + 0.5 * elapsed * curvature)


def cubic_hermite(start: Sequence[float], end: Sequence[float], step: float, fraction: float) -> Tuple[float, float]:
    """Value and rate of the cubic Hermite interpolant of (value, rate) at both ends, at ``fraction`` (0 to 1)."""
    (x0, v0), (x1, v1) = start, end
    gap, slope0, slope1 = x1 - x0, step * v0, step * v1
    c2 = 3.0 * gap - 2.0 * slope0 - slope1
    c3 = slope0 + slope1 - 2.0 * gap
    f = fraction
    return x0 + f * (slope0 + f * (c2 + f * c3)), (slope0 + f * (2.0 * c2 + 3.0 * f * c3)) / step


def quintic_hermite(
    start: Sequence[float], end: Sequence[float], step: float, fraction: float
) -> Tuple[float, float, float]:
    """Value, rate and curvature of the quintic Hermite interpolant of value, rate and curvature at both ends.

    ``start`` and ``end`` are (value, rate, curvature); the fraction runs from 0 to 1.
    """
    x0, v0, a0 = start
    x1, v1, a1 = end
    half_square = 0.5 * step * step
    position_mismatch = x1 - x0 - step * v0 - half_square * a0
    rate_mismatch = step * (v1 - v0) - 2.0 * half_square * a0
    curvature_mismatch = half_square * (a1 - a0)
    c3 = 10.0 * position_mismatch - 4.0 * rate_mismatch + curvature_mismatch
    c4 = -15.0 * position_mismatch + 7.0 * rate_mismatch - 2.0 * curvature_mismatch
    c5 = 6.0 * position_mismatch - 3.0 * rate_mismatch + curvature_mismatch
    f = fraction
    value = x0 + f * (step * v0 + f * (half_square * a0 + f * (c3 + f * (c4 + f * c5))))
    slope = step * v0 + f * (2.0 * half_square * a0 + f * (3.0 * c3 + f * (4.0 * c4 + f * 5.0 * c5)))
    curvature = 2.0 * half_square * a0 + f * (6.0 * c3 + f * (12.0 * c4 + f * 20.0 * c5))
    return value, slope / step, curvature / (step * step)
