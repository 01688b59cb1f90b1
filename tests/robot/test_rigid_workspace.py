"""Workspaces of platforms that turn, against linear programs, closed forms and symmetry."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from tautwire.errors import InputError
from tautwire.robot.kinematics import structure_matrix
from tautwire.robot.pose_grid import orientation_grid, position_grid
from tautwire.robot.rigid_equilibrium import load_wrench, platform_size, static_equilibrium
from tautwire.robot.schema import Platform, Quaternion, Robot, Sensors, TensionLimits
from tautwire.robot.workspace import workspace_on, wrench_feasible_workspace, wrench_margin
from tautwire.robot.workspace_criteria import RequiredMotion, wrench_closure_margin, wrench_feasible_margin
from tests.support.rigid_robots import cable, crane_robot, octahedral_robot, suspended_robot

AT_REST = RequiredMotion()
CORNERS = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]


def boxed_robot() -> Robot:
    """Eight cables from the corners of a frame to those of a small box, each crossed in the horizontal plane."""
    anchors = [(2.0 * x, 2.0 * y, 1.5 * z) for x, y, z in CORNERS]
    attachments = [(0.2 * x, -0.2 * y, -0.1 * z) for x, y, z in CORNERS]
    platform = Platform(10.0, (0.0, 0.0, 0.0), inertia=((0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.5)))
    cables = tuple(cable(*pair) for pair in zip(anchors, attachments, strict=True))
    return Robot("boxed", 9.81, platform, TensionLimits(10.0, 500.0, 100.0), Sensors(), cables)


def random_poses(robot: Robot, count: int, reach: float, angle: float) -> list[tuple[np.ndarray, Quaternion]]:
    generator = np.random.default_rng(5)
    poses = []
    for _ in range(count):
        x, y, z, w = Rotation.from_rotvec(angle * generator.standard_normal(3)).as_quat().tolist()
        position = np.array(robot.platform.start) + reach * generator.uniform(-1.0, 1.0, 3)
        poses.append((position, (w, x, y, z)))
    return poses


def tensions_exist(matrix: np.ndarray, wrench: np.ndarray, minimum: float, maximum: float | None) -> bool:
    program = linprog(np.zeros(matrix.shape[1]), A_eq=matrix, b_eq=wrench, bounds=(minimum, maximum))
    return program.status == 0


@pytest.mark.parametrize(("robot", "reach"), ((crane_robot(), 6.0), (boxed_robot(), 1.4)), ids=("crane", "boxed"))
def test_wrench_feasible_poses_are_those_where_a_linear_program_finds_tensions(robot: Robot, reach: float) -> None:
    limits = robot.tension
    assert limits is not None
    verdicts = []
    for pose in random_poses(robot, 60, reach, 0.35):
        matrix, load = structure_matrix(robot, *pose), load_wrench(robot, *pose)
        feasible = tensions_exist(matrix, load, limits.minimum, limits.maximum)
        assert (wrench_feasible_margin(robot, *pose, AT_REST) >= 0.0) == feasible
        verdicts.append(feasible)
    assert 5 < sum(verdicts) < 55


def test_wrench_closure_is_where_a_linear_program_finds_tensions_that_balance_each_other() -> None:
    robot, verdicts = boxed_robot(), []
    for pose in random_poses(robot, 60, 1.2, 0.3):
        matrix = structure_matrix(robot, *pose)
        closed = tensions_exist(matrix, np.zeros(6), 1.0, None) and np.linalg.matrix_rank(matrix) == 6
        assert (wrench_closure_margin(robot, *pose, AT_REST) > 0.0) == closed
        verdicts.append(closed)
    assert 5 < sum(verdicts) < 55


def test_a_platform_that_hangs_from_above_has_no_wrench_closure() -> None:
    workspace = workspace_on(position_grid(crane_robot(), spacing=3.0), crane_robot(), "wrench-closure")
    assert not workspace.feasible.any() and np.isnan(workspace.margin).all()


def test_a_wrench_as_large_as_the_margin_is_just_exerted() -> None:
    robot = crane_robot()
    pose = (np.array([0.5, -0.4, 1.8]), robot.platform.start_orientation)
    scale = np.array([1.0] * 3 + [1.0 / platform_size(robot)] * 3)
    matrix, load = scale[:, None] * structure_matrix(robot, *pose), scale * load_wrench(robot, *pose)
    margin, limits = wrench_feasible_margin(robot, *pose, AT_REST), robot.tension
    assert limits is not None and margin > 1.0
    normals = [np.linalg.svd(matrix[:, list(five)].T)[2][-1] for five in combinations(range(8), 5)]
    pushes = [side * margin * normal for normal in normals for side in (1.0, -1.0)]
    bounds = (limits.minimum, limits.maximum)
    assert all(tensions_exist(matrix, load + 0.999 * push, *bounds) for push in pushes)
    assert not all(tensions_exist(matrix, load + 1.001 * push, *bounds) for push in pushes)


def test_six_cables_in_a_hexapod_hold_the_platform_by_the_least_share_of_a_face() -> None:
    robot = octahedral_robot()
    pose = (np.array(robot.platform.start), robot.platform.start_orientation)
    # Tensions T = A^-1 w: a wrench n / |n| of one cable's row n changes its tension by |n|.
    scale = np.array([1.0] * 3 + [1.0 / platform_size(robot)] * 3)
    inverse = np.linalg.inv(scale[:, None] * structure_matrix(robot, *pose))
    tensions = static_equilibrium(robot).tensions
    expected = np.min(tensions / np.linalg.norm(inverse, axis=1))
    assert wrench_margin(robot, pose[0]) == pytest.approx(expected, rel=1e-9)


def test_accelerations_take_from_the_margin_and_angular_ones_too() -> None:
    robot = boxed_robot()
    pose = (np.zeros(3), robot.platform.start_orientation)
    limits = robot.tension
    assert limits is not None
    motion = RequiredMotion(3.0, 20.0)
    margin = wrench_feasible_margin(robot, *pose, motion)
    assert (
        margin
        < wrench_feasible_margin(robot, *pose, RequiredMotion(3.0))
        < wrench_feasible_margin(robot, *pose, AT_REST)
    )
    inertia = np.array(robot.platform.inertia)
    corners = [np.concatenate([30.0 * np.array(f), 20.0 * inertia @ np.array(a)]) for f in CORNERS for a in CORNERS]
    matrix, load = structure_matrix(robot, *pose), load_wrench(robot, *pose)
    held = [tensions_exist(matrix, load + corner, limits.minimum, limits.maximum) for corner in corners]
    assert all(held) == (margin >= 0.0)


@pytest.mark.validate
def test_a_symmetric_robot_has_a_symmetric_workspace() -> None:
    robot = replace(boxed_robot(), gravity=0.0)
    workspace = workspace_on(position_grid(robot, spacing=0.75), robot)
    for axis in range(3):
        assert workspace.margin == pytest.approx(np.flip(workspace.margin, axis), rel=1e-9, abs=1e-9, nan_ok=True)
    turned = workspace_on(orientation_grid(robot, (0.4, 0.4, 0.6), spacing=0.2), robot)
    assert turned.axis_names == ("rotation_x", "rotation_y", "rotation_z")
    # A reflection along one axis reverses the rotations about the two others.
    for axes in combinations(range(3), 2):
        assert turned.margin == pytest.approx(np.flip(turned.margin, axes), rel=1e-6)
    assert 0 < turned.feasible.sum() < turned.feasible.size


def test_over_a_range_of_orientations_the_worst_one_counts() -> None:
    robot = crane_robot()
    box = ((0.3, -0.2, 1.5), (0.3, -0.2, 1.5), 1.0)
    grid = position_grid(robot, *box, rotation_range=(0.1, 0.0, 0.3))
    assert len(grid.orientations) == 9
    margins = [
        workspace_on(position_grid(robot, *box, orientation=orientation), robot).margin.item()
        for orientation in grid.orientations
    ]
    assert workspace_on(grid, robot).margin.item() == min(margins) < wrench_margin(robot, np.array(box[0]))


def test_fewer_cables_have_a_static_workspace_only() -> None:
    robot = suspended_robot(4)
    grid = position_grid(robot, (-1.0, -1.0, 1.5), (1.0, 1.0, 1.5), 1.0)
    workspace = workspace_on(grid, robot, "static")
    assert workspace.feasible.all()
    centre = workspace.frame().iloc[4]
    assert centre.lowest_tension == pytest.approx(centre.highest_tension)
    for criterion in ("wrench-feasible", "wrench-closure"):
        with pytest.raises(InputError, match="4 cables cannot exert a moment of every direction"):
            workspace_on(grid, robot, criterion)
    with pytest.raises(InputError, match="leave no orientation to choose"):
        workspace_on(orientation_grid(robot, (0.1, 0.1, 0.1)), robot, "static")


def test_six_cables_never_close_and_a_criterion_has_to_be_known() -> None:
    robot = octahedral_robot()
    with pytest.raises(InputError, match="6 cables, which only pull, never exert every wrench"):
        workspace_on(position_grid(robot), robot, "wrench-closure")
    with pytest.raises(InputError, match="write 'static'"):
        workspace_on(position_grid(robot), robot, "statics")


def test_the_table_of_a_rigid_platform_tells_of_interference() -> None:
    table = wrench_feasible_workspace(crane_robot(), (-1.0, -1.0, 1.0), (1.0, 1.0, 2.0), 1.0).frame()
    assert list(table)[-3:] == ["highest_tension", "cables_interfere", "platform_interferes"]
    assert set(table.cables_interfere) | set(table.platform_interferes) <= {0, 1}


def test_a_point_mass_does_not_turn() -> None:
    robot = replace(boxed_robot(), platform=replace(boxed_robot().platform, inertia=None))
    with pytest.raises(InputError, match="point mass, which does not turn"):
        orientation_grid(robot, (0.1, 0.1, 0.1))
    with pytest.raises(InputError, match="point mass, which does not turn"):
        position_grid(robot, rotation_range=(0.1, 0.0, 0.0))
    with pytest.raises(InputError, match="three rotations from 0 to pi rad"):
        orientation_grid(boxed_robot(), (4.0, 0.1, 0.1))
