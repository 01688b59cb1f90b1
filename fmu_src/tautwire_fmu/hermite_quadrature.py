"""Hermite interpolation of inputs between communication points, and exact integration of Hermite polynomials.

The weights are the exact integrals of the polynomial through value and rate at its nodes: at both ends (a cubic), or
at both ends and the middle (a quintic).
"""

from __future__ import annotations

from typing import NamedTuple, Sequence, Tuple


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


WeightPairs = Tuple[Tuple[float, float], ...]


class QuadratureWeights(NamedTuple):
    """Quadrature weights of each node's (acceleration, its rate), at a fraction of the step (0 to 1).

    They are times (h^2, h^3) for the position, (h, h^2) for the velocity, (1, h) for the acceleration; the last are
    empty where a node stands there.
    """

    fraction: float
    position: WeightPairs
    velocity: WeightPairs
    acceleration: WeightPairs = ()


CUBIC_MIDDLE = QuadratureWeights(
    0.5,
    ((9 / 80, 23 / 1920), (1 / 80, -7 / 1920)),
    ((13 / 32, 11 / 192), (3 / 32, -5 / 192)),
    ((1 / 2, 1 / 8), (1 / 2, -1 / 8)),
)
CUBIC_END = QuadratureWeights(
    1.0,
    ((7 / 20, 1 / 20), (3 / 20, -1 / 30)),
    ((1 / 2, 1 / 12), (1 / 2, -1 / 12)),
)
QUINTIC_MIDDLE = QuadratureWeights(
    0.5,
    ((13 / 168, 59 / 13440), (1 / 24, -1 / 105), (1 / 168, -11 / 13440)),
    ((101 / 480, 13 / 960), (4 / 15, -1 / 24), (11 / 480, -1 / 320)),
)
QUINTIC_END = QuadratureWeights(
    1.0,
    ((79 / 420, 1 / 84), (4 / 15, -2 / 105), (19 / 420, -1 / 210)),
    ((7 / 30, 1 / 60), (8 / 15, 0.0), (7 / 30, -1 / 60)),
)


class AccelerationNode(NamedTuple):
    """Quadrature node: acceleration and its rate, one number an axis."""

    acceleration: Sequence[float]
    jerk: Sequence[float]


class MotionState(NamedTuple):
    """Motion state: position, velocity and acceleration, one number an axis."""

    position: Sequence[float]
    velocity: Sequence[float]
    acceleration: Sequence[float]


def integrate_hermite(
    start: MotionState, nodes: Sequence[AccelerationNode], step: float, weights: QuadratureWeights
) -> MotionState:
    """Integrate the Hermite polynomial through ``nodes`` from ``start`` to the weights' fraction of the step."""
    elapsed, step_squared = weights.fraction * step, step * step
    unaccelerated = [x + elapsed * v for x, v in zip(start.position, start.velocity)]
    position = apply_weights(unaccelerated, nodes, step_squared, step * step_squared, weights.position)
    velocity = apply_weights(start.velocity, nodes, step, step_squared, weights.velocity)
    if weights.acceleration:
        acceleration = apply_weights([0.0] * len(unaccelerated), nodes, 1.0, step, weights.acceleration)
    else:
        acceleration = nodes[int(weights.fraction * (len(nodes) - 1))].acceleration
    return MotionState(position, velocity, acceleration)


def apply_weights(
    start: Sequence[float],
    nodes: Sequence[Tuple[Sequence[float], Sequence[float]]],
    scale: float,
    rate_scale: float,
    weights: WeightPairs,
) -> Sequence[float]:
    """``start`` and the weighted sum over ``nodes`` of value and rate, one number an axis."""
    if len(nodes) == 2:
        first, last = nodes
        (a0, j0), (a1, j1) = weights
        a0, a1, j0, j1 = scale * a0, scale * a1, rate_scale * j0, rate_scale * j1
        return [x + (a0 * p + j0 * q + a1 * r + j1 * s) for x, p, q, r, s in zip(start, *first, *last)]
    first, middle, last = nodes
    (a0, j0), (am, jm), (a1, j1) = weights
    a0, am, a1 = scale * a0, scale * am, scale * a1
    j0, jm, j1 = rate_scale * j0, rate_scale * jm, rate_scale * j1
    return [
        x + (a0 * p + j0 * q + am * r + jm * s + a1 * t + j1 * u)
        for x, p, q, r, s, t, u in zip(start, *first, *middle, *last)
    ]
