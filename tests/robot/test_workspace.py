from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.errors import InputError, UnreachableError
from tautwire.robot.cable_routes import unit_directions
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Cable, EffectSetting, Platform, Robot, Sensors, TensionLimits
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.tension_distribution import distribute_tensions
from tautwire.robot.workspace import wrench_feasible_workspace, wrench_margin
from tests.support.planar import VERTICAL, robot_text
from tests.support.robots import NAMES, example, paper_robot


def cross(limits: TensionLimits | None = None) -> Robot:
    """Six cables along the axes, 10 m long, on a mass without weight."""
    anchors = tuple(tuple(10.0 * side * axis) for axis in np.eye(3) for side in (1.0, -1.0))
    cables = tuple(Cable(anchor, 1e9, 1e-5, 0.0, "logarithmic") for anchor in anchors)
    return Robot("cross", 0.0, Platform(50.0, (0.0, 0.0, 0.0)), limits, Sensors(), cables)


@pytest.mark.validate(only=["three"])
@pytest.mark.parametrize("name", NAMES)
def test_it_is_where_statics_finds_tensions(name: str) -> None:
    robot = example(name)
    workspace = wrench_feasible_workspace(robot, spacing=1.0 if name == "eight" else None)
    assert 0.2 < workspace.feasible.mean() < 0.9
    assert np.array_equal(workspace.feasible, np.isfinite(workspace.min_tension))
    assert np.array_equal(workspace.feasible, np.isfinite(workspace.max_tension))


def test_the_margin_by_hand() -> None:
    # Each axis can pull with 10 to 90 N either way: with 80 N at most in all, least across a face.
    assert wrench_margin(cross(TensionLimits(10.0, 90.0, 50.0)), np.zeros(3)) == pytest.approx(80.0)


def test_the_margin_of_three_cables_is_the_distance_to_the_nearest_plane() -> None:
    robot = paper_robot()
    position = np.array([30.0, 5.0, 10.0])
    unit, load = unit_directions(robot, position), np.array([0.0, 0.0, 300.0 * 9.8])
    distances = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        normal = np.cross(unit[:, i], unit[:, j])
        normal /= np.linalg.norm(normal) * np.sign(normal @ unit[:, k])
        distances.append(normal @ load)
    assert wrench_margin(robot, position) == pytest.approx(min(distances))


def test_a_force_as_large_as_the_margin_is_just_held() -> None:
    robot, position = example("eight"), np.array([7.0, 5.0, 4.5])
    limits, margin = robot.tension, wrench_margin(robot, position)
    assert limits is not None
    unit, weight = unit_directions(robot, position), np.array([0.0, 0.0, 60.0 * 9.81])
    normals = [np.cross(unit[:, i], unit[:, j]) for i, j in permutations(range(8), 2)]
    pushes = [margin * normal / np.linalg.norm(normal) for normal in normals]
    assert all(distribute_tensions(unit, weight + 0.999 * push, limits) is not None for push in pushes)
    assert any(distribute_tensions(unit, weight + 1.001 * push, limits) is None for push in pushes)


def test_accelerations_take_from_the_margin() -> None:
    robot, position = cross(TensionLimits(10.0, 90.0, 50.0)), np.zeros(3)
    assert wrench_margin(robot, position, 0.5) == pytest.approx(80.0 - 25.0)
    assert wrench_margin(robot, position, 2.0) == pytest.approx(-20.0)


def test_payload_counts() -> None:
    robot, position = paper_robot(), np.array([30.0, 5.0, 10.0])
    heavier = robot.with_effect(EffectSetting("payload", {"mass": 150.0}))
    assert wrench_margin(heavier, position) == pytest.approx(1.5 * wrench_margin(robot, position))


def test_the_grid_has_the_start_and_stays_in_its_box() -> None:
    workspace = wrench_feasible_workspace(paper_robot(), (20.0, -6.0, 4.0), (40.0, 6.0, 10.0), 2.5)
    x, y, z = workspace.axes
    assert x.tolist() == pytest.approx([21.36, 23.86, 26.36, 28.86, 31.36, 33.86, 36.36, 38.86])
    assert y.tolist() == [-5.0, -2.5, 0.0, 2.5, 5.0]
    assert z.tolist() == [5.0, 7.5, 10.0]


def test_a_box_without_the_start_begins_at_its_corner() -> None:
    workspace = wrench_feasible_workspace(paper_robot(), (40.0, 1.0, 20.0), (44.0, 1.0, 20.0), 2.0)
    assert [axis.tolist() for axis in workspace.axes] == [[40.0, 42.0, 44.0], [1.0], [20.0]]


def test_the_table_has_a_row_for_each_position() -> None:
    workspace = wrench_feasible_workspace(example("caroca"), spacing=1.5)
    table = workspace.frame()
    assert list(table) == ["x", "y", "z", "feasible", "margin", "lowest_tension", "highest_tension"]
    assert len(table) == workspace.margin.size
    row = table[(table.x == 1.0) & (table.y == 0.0) & (table.z == 1.0)].iloc[0]
    tensions = static_tensions(example("caroca"))
    assert (row.lowest_tension, row.highest_tension) == pytest.approx((tensions.min(), tensions.max()))
    assert row.feasible == 1 and row.margin > 0.0


def test_at_an_exit_point_there_is_nothing() -> None:
    workspace = wrench_feasible_workspace(paper_robot(), (0.0, 50.0, 50.0), (0.0, 50.0, 50.0), 1.0)
    assert np.isnan(workspace.margin).all() and not workspace.feasible.any()
    with pytest.raises(UnreachableError, match="has no length"):
        wrench_margin(paper_robot(), np.array([0.0, 50.0, 50.0]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"spacing": 0.0}, "not positive"),
        ({"spacing": 0.01}, "points, more than"),
        ({"acceleration": -1.0}, "negative"),
        ({"lower": (1.0, 0.0, 9.0), "upper": (0.0, 0.0, 9.0)}, "lower ones first"),
        ({"lower": (1.0, 0.0)}, "three finite coordinates"),
    ],
)
def test_what_makes_no_grid_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        wrench_feasible_workspace(paper_robot(), **arguments)


def test_a_planar_robot_has_a_workspace_in_its_plane(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text(robot_text(VERTICAL))
    robot = read_robot(tmp_path / "robot.toml")
    workspace = wrench_feasible_workspace(robot, spacing=0.2)
    assert 0.1 < workspace.feasible.mean() < 0.95
    assert np.array_equal(workspace.feasible, np.isfinite(workspace.min_tension))
    start = np.array(robot.platform.start)
    still = wrench_margin(robot, start)
    # Two axes, each either way: one of the corners is against the face.
    assert 0.0 < wrench_margin(robot, start, 1.0) < still
    out_of_plane = start + [axis not in robot.axes_in_plane for axis in range(3)]
    assert wrench_margin(robot, out_of_plane) < 0.0
