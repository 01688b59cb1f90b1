"""Motion under accelerations that are polynomials."""

import numpy as np
import pytest

from tautwire_fmu.hermite_quadrature import (
    CUBIC_END,
    CUBIC_MIDDLE,
    QUINTIC_END,
    QUINTIC_MIDDLE,
    AccelerationNode,
    MotionState,
    QuadratureWeights,
    integrate_hermite,
)

STEP = 0.7


@pytest.mark.parametrize(
    ("degree", "nodes", "weights"),
    [
        (3, (0.0, 1.0), CUBIC_MIDDLE),
        (3, (0.0, 1.0), CUBIC_END),
        (5, (0.0, 0.5, 1.0), QUINTIC_MIDDLE),
        (5, (0.0, 0.5, 1.0), QUINTIC_END),
    ],
)
def test_the_integral_is_exact(degree: int, nodes: tuple[float, ...], weights: QuadratureWeights) -> None:
    acceleration = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0, -1.0, 2.0][: degree + 1])
    velocity = acceleration.integ(1, [0.3])
    position = velocity.integ(1, [-4.0])
    given = [AccelerationNode([acceleration(f * STEP)], [acceleration.deriv()(f * STEP)]) for f in nodes]
    there = integrate_hermite(MotionState([-4.0], [0.3], ()), given, STEP, weights)
    time = weights.fraction * STEP
    assert there.position == pytest.approx([position(time)], rel=1e-13)
    assert there.velocity == pytest.approx([velocity(time)], rel=1e-13)
    assert there.acceleration == pytest.approx([acceleration(time)], rel=1e-13)
