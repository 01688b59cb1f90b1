"""How uncertain numbers move a static start, against the statics of robots that have other numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.robot.cable_routes import cable_routes
from tautwire.robot.equilibrium_slopes import equilibrium_slopes
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import Robot
from tautwire.robot.uncertain_parameters import perturbed_robot, uncertain_parameters
from tautwire_fmu.laws.mathematics import REAL
from tests.support.rigid_robots import suspended_robot, underactuated_robot


def surveyed(robot: Robot) -> Robot:
    platform = replace(robot.platform, mass_uncertainty=0.5, centre_of_mass_uncertainty=0.01)
    cables = (replace(each, anchor_uncertainty=0.01, attachment_uncertainty=0.01) for each in robot.cables)
    return replace(robot, platform=platform, cables=tuple(cables))


def start_of(robot: Robot, declared_tensions: np.ndarray) -> np.ndarray:
    """Rotation vector of the start from the declared orientation, and what the ropes measure under their tensions."""
    equilibrium = static_equilibrium(robot)
    turned, declared = (
        Rotation.from_quat(np.roll(each, -1)) for each in (equilibrium.orientation, robot.platform.start_orientation)
    )
    routes = cable_routes(REAL, robot, robot.platform.start, equilibrium.orientation)
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    stretched = np.exp((declared_tensions - equilibrium.tensions) / stiffness)
    return np.append((turned * declared.inv()).as_rotvec(), stretched * [route.length for route in routes])


@pytest.mark.parametrize("robot", [suspended_robot(3), underactuated_robot()], ids=["three", "four over pulleys"])
def test_slopes_are_differences_of_equilibria(robot: Robot) -> None:
    robot, width = surveyed(robot), 1e-3
    parameters, tensions = uncertain_parameters(robot), static_equilibrium(robot).tensions
    slopes = equilibrium_slopes(robot)
    assert slopes.shape == (3 + robot.cable_count, len(parameters))
    for column, step in zip(slopes.T, width * np.eye(len(parameters)), strict=True):
        more, less = (
            start_of(perturbed_robot(robot, parameters, (sign * step).tolist()), tensions) for sign in (1.0, -1.0)
        )
        assert column == pytest.approx((more - less) / (2.0 * width), rel=1e-3, abs=1e-6)
