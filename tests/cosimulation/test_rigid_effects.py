"""Effects of rigid platforms in the co-simulated FMUs and in statics, against the rig's own equations."""

from __future__ import annotations

from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import Robot
from tautwire.robot.static_equilibrium import start_orientation, static_tensions
from tests.rig import Rig, SampledProgram, StillProgram
from tests.rig.record import readings
from tests.support.effect_cases import RIGID_CASES, Case, same
from tests.support.effects import EXACT, with_effects
from tests.support.rig_robots import rig_of
from tests.support.rigid_robots import crane_robot, suspended_robot

ROBOTS = [crane_robot(), suspended_robot(4)]
TIME = np.array([0.0, 0.2, 0.4, 0.8])


def by_the_rig(robot: Robot, case: Case) -> Robot:
    """The robot with the orientation at which it starts with the effect, which the rig then keeps."""
    return replace(
        robot, platform=replace(robot.platform, start_orientation=start_orientation(with_effects(robot, case)))
    )


@pytest.mark.validate(only=["suspended-centre_of_mass"])
@pytest.mark.parametrize("case", RIGID_CASES, ids=str)
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_statics_are_those_of_the_rig(robot: Robot, case: Case) -> None:
    rig = Rig(rig_of(by_the_rig(robot, case)), {case.name: case.for_rig()}, StillProgram(robot.cable_count))
    assert static_tensions(with_effects(robot, case)) == pytest.approx(rig.start_tension, rel=1e-6)


@pytest.mark.validate
@pytest.mark.parametrize("case", [RIGID_CASES[0], same("payload", mass=6.0, x=0.1, y=-0.05)], ids=str)
def test_the_orientation_at_the_start_is_that_of_the_rig(case: Case) -> None:
    robot = suspended_robot(4)
    rig = Rig(rig_of(robot), {case.name: case.for_rig()}, StillProgram(4))
    assert rig.turning is not None
    w, x, y, z = start_orientation(with_effects(robot, case))
    error = Rotation.from_quat((x, y, z, w)) * Rotation.from_matrix(rig.turning.start).inv()
    assert Rotation.from_matrix(rig.turning.start).magnitude() > 0.01
    assert error.magnitude() < 1e-6


# Each effect on one of the robots, in turn.
@pytest.mark.validate
@pytest.mark.parametrize(
    ("robot", "case"),
    list(zip(cycle(ROBOTS), RIGID_CASES, strict=False)),
    ids=lambda value: getattr(value, "name", str(value)),
)
def test_effects_in_the_fmus_are_those_of_the_rig(robot: Robot, case: Case, tmp_path: Path) -> None:
    speeds = np.zeros((len(TIME), robot.cable_count))
    speeds[1, :2] = [0.05, -0.02]
    found = cosimulate(build_fmus(with_effects(robot, case), tmp_path, native=True), TIME, speeds, 0.005)
    rig = Rig(rig_of(by_the_rig(robot, case)), {case.name: case.for_rig()}, SampledProgram(TIME, speeds))
    exact = readings(rig, TIME, EXACT)
    assert found.orientation is not None and exact.rotation is not None
    rotation = Rotation.from_quat(found.orientation[:, [1, 2, 3, 0]]).as_matrix()
    assert np.ptp(exact.rotation, axis=0).max() > 1e-4
    assert found.position == pytest.approx(exact.position, abs=1e-8)
    assert rotation == pytest.approx(exact.rotation, abs=1e-7)
    assert found.tension == pytest.approx(exact.tension, abs=1e-3)
