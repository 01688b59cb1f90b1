"""Polynomials through values and rates, and which outputs are rates of which."""

import numpy as np
import pytest

from tautwire.cosimulation import Port
from tautwire.cosimulation.hermite_interpolation import (
    DerivativeChain,
    derivative_chains,
    hermite_weights,
    scale_weights,
)
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.fmus.packaging import RobotFmus

NAMES = ("position", "velocity", "acceleration")


def test_a_polynomial_is_continued_exactly() -> None:
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    unit, times, at = 0.3, (-2.0, -0.5, 0.0), (0.5, 1.0)

    def known(time: float) -> list[float]:
        return [polynomial.deriv(k)(unit * time) for k in range(2)]

    weights = scale_weights(hermite_weights(times, 2, at), unit).reshape(4, 6)
    result = weights @ np.concatenate([known(time) for time in times])
    assert result == pytest.approx(np.concatenate([known(time) for time in at]), rel=1e-11)


def test_fmus_tell_which_output_is_the_rate_of_which(three_fmus: RobotFmus) -> None:
    shown = [Port("platform", f"{middle}{name}.x") for middle in ("", "middle_") for name in NAMES]
    shown += [Port("cable_1", name) for name in ("force_rate.y", "force.y", "tension")]
    with instantiate_robot(three_fmus) as graph:
        wanted = range(len(shown))
        assert derivative_chains(graph.components, shown, wanted) == [
            DerivativeChain((0, 1, 2), (3, 4, 5)),
            DerivativeChain((7, 6), None),
            DerivativeChain((8,), None),
        ]
        assert derivative_chains(graph.components, shown, (4,)) == [DerivativeChain((0, 1, 2), (3, 4, 5))]
