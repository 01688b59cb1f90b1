"""Effects of rigid platforms in the co-simulated FMUs against robots that are declared as the effects make them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.static_equilibrium import start_orientation, static_tensions
from tests.support.rigid_robots import crane_robot, suspended_robot

Array = NDArray[np.float64]

TIME = np.array([0.0, 0.2, 0.4, 0.8])


def run(robot: Robot, folder: Path) -> CosimulationResult:
    """A jerk of two winches, and what follows it."""
    speeds = np.zeros((len(TIME), robot.cable_count))
    speeds[1, :2] = [0.05, -0.02]
    return cosimulate(build_fmus(robot, folder), TIME, speeds, 0.01)


def pose(result: CosimulationResult) -> tuple[Array, Array]:
    assert result.orientation is not None
    return result.position, Rotation.from_quat(result.orientation[:, [1, 2, 3, 0]]).as_matrix()


def with_centre(robot: Robot) -> tuple[Robot, Robot]:
    x, y, z = robot.platform.centre_of_mass
    declared = replace(robot, platform=replace(robot.platform, centre_of_mass=(x + 0.02, y - 0.01, z + 0.03)))
    return robot.with_effect(EffectSetting("centre_of_mass", {"x": 0.02, "y": -0.01, "z": 0.03})), declared


def with_attachment(robot: Robot) -> tuple[Robot, Robot]:
    x, y, z = robot.cables[1].attachment
    moved = replace(robot.cables[1], attachment=(x + 0.02, y, z - 0.03))
    declared = replace(robot, cables=(robot.cables[0], moved, *robot.cables[2:]))
    return robot.with_effect(EffectSetting("attachment", {"x": 0.02, "z": -0.03}, (2,))), declared


def with_inertia(robot: Robot) -> tuple[Robot, Robot]:
    declared = np.array(robot.platform.inertia)
    moments, axes = np.linalg.eigh(declared)
    order = np.argmax(np.abs(axes), axis=0)
    factors = np.array([1.5, 0.8, 1.2])
    changed = (axes * (moments * factors[order])) @ axes.T
    x, y, z = (tuple(row) for row in changed.tolist())
    values = dict(zip(("factor_x", "factor_y", "factor_z"), factors.tolist(), strict=True))
    platform = replace(robot.platform, inertia=(x, y, z))
    return robot.with_effect(EffectSetting("inertia", values)), replace(robot, platform=platform)


def with_payload(robot: Robot) -> tuple[Robot, Robot]:
    platform, mass, arm = robot.platform, 6.0, np.array([0.1, -0.05, 0.3])
    total = platform.mass + mass
    x, y, z = np.add(platform.centre_of_mass, mass / total * arm).tolist()
    reduced = platform.mass * mass / total
    inertia = np.array(platform.inertia) + reduced * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    a, b, c = (tuple(row) for row in inertia.tolist())
    declared = replace(platform, mass=total, centre_of_mass=(x, y, z), inertia=(a, b, c))
    values = {"mass": mass, "x": 0.1, "y": -0.05, "z": 0.3}
    return robot.with_effect(EffectSetting("payload", values)), replace(robot, platform=declared)


CHANGES = [with_centre, with_attachment, with_inertia, with_payload]


@pytest.mark.parametrize("changed", CHANGES)
@pytest.mark.parametrize("robot", [crane_robot(), suspended_robot(4)], ids=lambda robot: robot.name)
def test_statics_take_the_constants_that_effects_make(
    robot: Robot, changed: Callable[[Robot], tuple[Robot, Robot]]
) -> None:
    effect, declared = changed(robot)
    assert static_tensions(effect) == pytest.approx(static_tensions(declared), rel=1e-7)
    assert start_orientation(effect) == pytest.approx(start_orientation(declared), abs=1e-8)


@pytest.mark.validate
@pytest.mark.parametrize("changed", CHANGES)
@pytest.mark.parametrize("robot", [crane_robot(), suspended_robot(4)], ids=lambda robot: robot.name)
def test_an_effect_that_changes_a_constant_is_the_robot_with_that_constant(
    robot: Robot, changed: Callable[[Robot], tuple[Robot, Robot]], tmp_path: Path
) -> None:
    effect, declared = changed(robot)
    found, expected = run(effect, tmp_path / "effect"), run(declared, tmp_path / "declared")
    assert pose(found)[0] == pytest.approx(pose(expected)[0], abs=1e-8)
    assert pose(found)[1] == pytest.approx(pose(expected)[1], abs=1e-7)
    assert found.tension == pytest.approx(expected.tension, abs=1e-3)
    plain = run(robot, tmp_path / "plain")
    assert max(np.max(np.abs(a - b)) for a, b in zip(pose(found), pose(plain), strict=True)) > 1e-6
