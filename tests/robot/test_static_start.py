"""Roots in the place of formulas."""

import casadi
import numpy as np
import pytest
from casadi import SX

from tautwire.robot.static_start import ImplicitRoot


def test_of_a_root_that_is_not_the_only_one_the_derivative_is_the_smallest() -> None:
    unknowns, parameter = SX.sym("z", 2), SX.sym("p")
    inverse = np.array([[0.5], [0.5]])
    values, equations = casadi.vertcat(0.5 * parameter, 0.5 * parameter), casadi.sum1(unknowns) - parameter
    root = ImplicitRoot(unknowns, values, equations, inverse, inverse @ np.array([[1.0, 1.0]]))
    assert np.array(casadi.Function("slope", [unknowns], [root.jacobian(parameter)])(0.0)).ravel() == pytest.approx(0.5)
