"""The linear plant of a rigid platform: closed forms, another derivation of its stiffness, and a measured robot."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from tautwire.linear import linearise, modes_along
from tautwire.linear.modes import cable_energies
from tautwire.linear.operating_point import Pose
from tautwire.robot.pose_stiffness import stiffness_matrix
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Cable, Platform, Robot, Sensors
from tests.support.folders import SHARED_RECORDINGS
from tests.support.rigid_robots import crane_robot, octahedral_robot

RINGDOWNS = SHARED_RECORDINGS / "real-ringdowns"
GRAVITY, LENGTH, RADIUS = 9.81, 3.0, 0.6
ROBOTS = {"crane": crane_robot(), "octahedral": octahedral_robot()}


def hanging_platform(centre_height: float = 0.0) -> Robot:
    """A platform on four parallel, stiff ropes at equal distances from its axis."""
    corners = [(RADIUS * cos(angle), RADIUS * sin(angle)) for angle in (0.0, pi / 2, pi, 3 * pi / 2)]
    cables = [Cable((x, y, LENGTH), 1e11, 1e-3, 0.0, "linear", attachment=(x, y, 0.0)) for x, y in corners]
    inertia = ((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 7.0))
    platform = Platform(50.0, (0.0, 0.0, 0.0), inertia=inertia, centre_of_mass=(0.0, 0.0, centre_height))
    return Robot("hanging", GRAVITY, platform, None, Sensors(), tuple(cables))


def test_a_platform_on_parallel_ropes_swings_as_a_pendulum_and_turns_as_a_multifilar_one() -> None:
    plant = linearise(hanging_platform())
    # Ropes of finite stiffness stretch: 50 kg on 4 x 33 MN/m, a rise of 1e-6 of the length.
    turning = sqrt(50.0 * GRAVITY * RADIUS**2 / (7.0 * LENGTH)) / (2.0 * pi)
    swinging = sqrt(GRAVITY / LENGTH) / (2.0 * pi)
    assert plant.modes.frequencies[:3] == pytest.approx(sorted([swinging, swinging, turning]), rel=1e-5)
    shares = plant.modes.translational_shares[:3]
    assert sorted(shares.tolist()) == pytest.approx([0.0, 1.0, 1.0], abs=1e-9)


def test_a_centre_of_mass_above_the_attachments_does_not_change_how_parallel_ropes_swing() -> None:
    """Parallel ropes keep the platform level: it moves without turning, and its centre of mass as a point mass does."""
    plant = linearise(hanging_platform(centre_height=0.4))
    swinging = sqrt(GRAVITY / LENGTH) / (2.0 * pi)
    assert np.sum(np.abs(plant.modes.frequencies / swinging - 1.0) < 1e-5) == 2


@pytest.mark.parametrize("name", ROBOTS)
def test_the_stiffness_is_the_one_that_statics_gives(name: str) -> None:
    robot = ROBOTS[name]
    system, n = linearise(robot).system, robot.cable_count
    mass = np.linalg.inv(system.B[6:12, n:])
    stiffness = -mass @ system.A[6:12, :6]
    expected = stiffness_matrix(robot)
    assert np.max(np.abs(stiffness - expected)) < 1e-12 * np.max(np.abs(expected))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_energies_of_the_cables_are_those_of_the_modes(name: str) -> None:
    robot = ROBOTS[name]
    plant = linearise(robot)
    pose = Pose(robot, plant.position, plant.orientation)
    energies = cable_energies(pose, plant.tensions, plant.tension_slopes, plant.modes.shapes)
    expected = np.einsum("ik,ij,jk->k", plant.modes.shapes, stiffness_matrix(robot), plant.modes.shapes)
    assert energies.sum(axis=0) == pytest.approx(expected, rel=1e-9)
    assert plant.modes.cable_shares.sum(axis=0) == pytest.approx(np.ones(6))


def test_signals_of_a_rigid_platform_have_names() -> None:
    system = linearise(ROBOTS["octahedral"]).system
    assert system.state_labels[:12] == [
        f"{name}_{axis}" for name in ("position", "rotation", "velocity", "angular_velocity") for axis in "xyz"
    ]
    assert system.input_labels[-6:] == [
        f"{name}_{axis}" for name in ("external_force", "external_moment") for axis in "xyz"
    ]
    assert system.nstates == 12 + 6


def test_the_largest_motion_along_a_shape_is_one_metre() -> None:
    plant = linearise(ROBOTS["crane"])
    moved = Pose(ROBOTS["crane"], plant.position, plant.orientation).displacements(plant.modes.shapes)
    assert np.linalg.norm(moved, axis=1).max(axis=0) == pytest.approx(np.ones(6))


@pytest.mark.validate
@pytest.mark.skipif(not RINGDOWNS.is_dir(), reason="no shared recordings beside the project")
@pytest.mark.parametrize("number", [1, 19, 37, 45, 49, 59])
def test_free_modes_of_a_measured_robot_follow_from_its_geometry(number: int) -> None:
    run = next(run for run in json.loads((RINGDOWNS / "ringdowns.json").read_text()) if run["run"] == number)
    robot = read_robot(RINGDOWNS / f"grab-{run['cables']}.toml")
    w, x, y, z = np.array(run["start_orientation"]) / np.linalg.norm(run["start_orientation"])
    robot = replace(robot, platform=replace(robot.platform, start=tuple(run["start"]), start_orientation=(w, x, y, z)))
    frequencies = linearise(robot).modes.frequencies[: 6 - run["cables"]]
    assert frequencies == pytest.approx(run["computed_hz"], rel=1e-4)
    measured = [(f, seen) for f, seen in zip(frequencies, run["measured_hz"], strict=True) if seen is not None]
    assert np.median([abs(f / seen - 1.0) for f, seen in measured]) < 0.05


def test_modes_along_a_path_are_those_of_its_points() -> None:
    robot = ROBOTS["crane"]
    points = np.linspace(robot.platform.start, np.add(robot.platform.start, (0.6, -0.4, 0.2)), 5)
    along = modes_along(robot, points)
    for found, shapes, point in zip(along.frequencies, along.shapes, points, strict=True):
        here = linearise(robot, point)
        assert np.sort(found) == pytest.approx(here.modes.frequencies)
        moved = Pose(robot, point, here.orientation).displacements(shapes)
        assert np.linalg.norm(moved, axis=1).max(axis=0) == pytest.approx(np.ones(6))
    assert along.modal_assurance.min() > 0.9


def test_modes_of_equal_frequency_keep_their_directions_along_a_path() -> None:
    """By symmetry two pairs of modes of the octahedral robot have equal frequencies anywhere on its axis."""
    points = np.linspace((0.0, 0.0, 1.4), (0.0, 0.0, 1.6), 4)
    along = modes_along(ROBOTS["octahedral"], points)
    assert along.modal_assurance.min() > 0.999
    assert np.all(np.abs(along.translational_shares.sum(axis=1) - 3.0) < 1e-9)


def test_a_turned_platform_is_the_same_robot_there() -> None:
    """Its stiffness is that of statics there, though the ropes were cut for the start."""
    robot = crane_robot()
    orientation = (cos(0.1), 0.0, 0.0, sin(0.1))
    plant = linearise(robot, (0.1, 0.2, 1.6), orientation=orientation)
    assert plant.orientation == orientation
    mass = np.linalg.inv(plant.system.B[6:12, 8:])
    expected = stiffness_matrix(robot, plant.tensions, (0.1, 0.2, 1.6), orientation)
    # The start tension of another place changes the lengths that the stiffness belongs to, by their strain.
    assert np.max(np.abs(-mass @ plant.system.A[6:12, :6] - expected)) < 2e-3 * np.max(np.abs(expected))
