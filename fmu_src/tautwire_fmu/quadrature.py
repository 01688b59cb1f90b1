"""Motion under an acceleration that runs on a Hermite polynomial over a step.

The weights are the exact integrals of the polynomial through value and rate at its nodes: at both ends (a cubic), or
at both ends and the middle (a quintic).
"""

from typing import NamedTuple, Sequence, Tuple

Pairs = Tuple[Tuple[float, float], ...]


class Weights(NamedTuple):
    """Where in the step (0 to 1), and what each node's (acceleration, its rate) adds there.

    Times (h^2, h^3) to the position, (h, h^2) to the velocity, (1, h) to the acceleration.
    """

    fraction: float
    position: Pairs
    velocity: Pairs
    acceleration: Pairs


CUBIC_MIDDLE = Weights(
    0.5,
    ((9 / 80, 23 / 1920), (1 / 80, -7 / 1920)),
    ((13 / 32, 11 / 192), (3 / 32, -5 / 192)),
    ((1 / 2, 1 / 8), (1 / 2, -1 / 8)),
)
CUBIC_END = Weights(
    1.0,
    ((7 / 20, 1 / 20), (3 / 20, -1 / 30)),
    ((1 / 2, 1 / 12), (1 / 2, -1 / 12)),
    ((0.0, 0.0), (1.0, 0.0)),
)
QUINTIC_MIDDLE = Weights(
    0.5,
    ((13 / 168, 59 / 13440), (1 / 24, -1 / 105), (1 / 168, -11 / 13440)),
    ((101 / 480, 13 / 960), (4 / 15, -1 / 24), (11 / 480, -1 / 320)),
    ((0.0, 0.0), (1.0, 0.0), (0.0, 0.0)),
)
QUINTIC_END = Weights(
    1.0,
    ((79 / 420, 1 / 84), (4 / 15, -2 / 105), (19 / 420, -1 / 210)),
    ((7 / 30, 1 / 60), (8 / 15, 0.0), (7 / 30, -1 / 60)),
    ((0.0, 0.0), (0.0, 0.0), (1.0, 0.0)),
)


class Node(NamedTuple):
    """Acceleration and its rate, one number an axis."""

    acceleration: Sequence[float]
    jerk: Sequence[float]


class Place(NamedTuple):
    """Position, velocity and acceleration, one number an axis."""

    position: Sequence[float]
    velocity: Sequence[float]
    acceleration: Sequence[float]


def integrate(start: Place, nodes: Sequence[Node], step: float, weights: Weights) -> Place:
    """Where the polynomial leads from ``start``, at the weights' fraction of the step."""
    reach = weights.fraction * step
    moved = _weighted(nodes, step, weights.position)
    sped = _weighted(nodes, step, weights.velocity)
    return Place(
        [x + reach * v + step * step * d for x, v, d in zip(start.position, start.velocity, moved)],
        [v + step * d for v, d in zip(start.velocity, sped)],
        _weighted(nodes, step, weights.acceleration),
    )


def _weighted(nodes: Sequence[Node], step: float, weights: Pairs) -> Sequence[float]:
    if len(nodes) == 2:
        first, last = nodes
        (a0, j0), (a1, j1) = weights
        j0, j1 = step * j0, step * j1
        return [a0 * p + j0 * q + a1 * r + j1 * s for p, q, r, s in zip(*first, *last)]
    first, middle, last = nodes
    (a0, j0), (am, jm), (a1, j1) = weights
    j0, jm, j1 = step * j0, step * jm, step * j1
    return [a0 * p + j0 * q + am * r + jm * s + a1 * t + j1 * u for p, q, r, s, t, u in zip(*first, *middle, *last)]
