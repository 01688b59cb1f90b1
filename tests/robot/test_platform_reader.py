"""Rigid platforms in robot files: what is read, what is refused, and that nothing is lost."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tautwire.errors import RobotFileError
from tautwire.robot.robot_file_editor import edited_robot_text
from tautwire.robot.robot_file_reader import read_robot, read_robot_with_sink, robot_from_text
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import Robot
from tests.support.rigid_robots import crane_robot, suspended_robot, underactuated_robot
from tests.support.robots import EXAMPLES

HEAD = """\
# Owner's notes
name = "sheet"
[platform]
mass = 20.0  # weighed
start = [0.0, 0.0, 1.0]
inertia = [[1.0, 0.1, 0.0], [0.1, 1.5, 0.0], [0.0, 0.0, 2.0]]  # from CAD
"""
CABLES = """
[[cable]]
anchor = [-3.0, 0.0, 4.0]
attachment = [-0.5, 0.0, 0.0]  # bolt A
modulus = 1e11
area = 1e-5
law = "linear"

[[cable]]
anchor = [3.0, 0.0, 4.0]
attachment = [0.5, 0.0, 0.0]
modulus = 1e11
area = 1e-5
law = "linear"
"""
POINT_MASS = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")


def read(text: str) -> Robot:
    """The robot of a text."""
    return robot_from_text(text, "robot.toml", "robot")


def refused(text: str) -> RobotFileError:
    """The error about a text."""
    with pytest.raises(RobotFileError) as caught:
        read(text)
    assert len(str(caught.value).splitlines()) == 1
    return caught.value


def test_a_rigid_platform_may_have_two_cables_and_defaults() -> None:
    robot = read(HEAD + CABLES)
    assert robot.platform.is_rigid_body
    assert robot.platform.inertia == ((1.0, 0.1, 0.0), (0.1, 1.5, 0.0), (0.0, 0.0, 2.0))
    assert robot.platform.centre_of_mass == (0.0, 0.0, 0.0)
    assert robot.platform.start_orientation == (1.0, 0.0, 0.0, 0.0)
    assert robot.attachments == ((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0))
    assert robot.cables[0].swivel_axis == (0.0, 0.0, 1.0)
    assert not read(POINT_MASS).platform.is_rigid_body


@pytest.mark.parametrize(
    ("inertia", "words"),
    (
        ("[[1, 2, 0], [0, 1, 0], [0, 0, 1]]", ("has 2 and 0 for xy", "symmetric")),
        ("[[1, 2, 0], [2, 1, 0], [0, 0, 1]]", ("principal moments -1, 1, 3 kg m^2", "above 0 kg m^2")),
        ("[[1, 0, 0], [0, 1, 0], [0, 0, 2.1]]", ("principal moments 1, 1, 2.1 kg m^2", "sum of the others")),
        ("[1, 1, 1]", ("platform.inertia[1]", "is 1, not a list of 3 numbers")),
        ("[[1, 0, 0], [0, 1], [0, 0, 1]]", ("platform.inertia[2]", "has 2 entries, must have 3")),
        ("[[1, 0, 0], [0, 1, 0], [0, 0, inf]]", ("platform.inertia[3]", "must be finite")),
        ("4.0", ("is 4.0, not a list of 3 rows",)),
    ),
)
def test_an_inertia_that_no_body_has_is_refused(inertia: str, words: tuple[str, ...]) -> None:
    message = str(refused(HEAD.replace("[[1.0, 0.1, 0.0], [0.1, 1.5, 0.0], [0.0, 0.0, 2.0]]", inertia) + CABLES))
    assert ("platform.inertia" in message and "about the centre of mass" in message) or "[[xx, xy, xz]" in message
    assert all(word in message for word in words), message


def test_a_flat_body_written_with_six_digits_is_accepted() -> None:
    flat = "[[0.333333, 0, 0], [0, 0.666667, 0], [0, 0, 1.000001]]"
    assert read(HEAD.replace("[[1.0, 0.1, 0.0], [0.1, 1.5, 0.0], [0.0, 0.0, 2.0]]", flat) + CABLES)


def test_rounded_quaternions_are_normalised_and_others_refused_with_the_normalised_one() -> None:
    orientation = read(HEAD + "start_orientation = [0.7071, 0.0, 0.7071, 0.0]\n" + CABLES).platform.start_orientation
    assert math.hypot(*orientation) == pytest.approx(1.0, abs=1e-15)
    error = refused(HEAD + "start_orientation = [1.0, 0.0, 1.0, 0.0]\n" + CABLES)
    assert error.where.endswith("platform.start_orientation")
    assert "norm 1.41421, must have 1 within 0.001" in error.problem
    assert "[0.707107, 0, 0.707107, 0]" in error.hint
    assert "norm 0, must" in refused(HEAD + "start_orientation = [0, 0, 0, 0]\n" + CABLES).problem
    assert "swivel_axis" in refused(HEAD + CABLES + "swivel_axis = [0.0, 1.0, 1.0]\n").where


@pytest.mark.parametrize(
    ("after", "line"),
    (
        ("[platform]\n", "centre_of_mass = [0.0, 0.0, 0.1]"),
        ("[platform]\n", "start_orientation = [1.0, 0.0, 0.0, 0.0]"),
        ("[platform]\n", "inertia_uncertainty = 0.1"),
        ("[[cable]]\n", "attachment = [0.1, 0.0, 0.0]"),
        ("[[cable]]\n", "attachment_uncertainty = 0.1"),
    ),
)
def test_a_point_mass_has_nothing_of_a_rigid_body(after: str, line: str) -> None:
    assert after in POINT_MASS
    error = refused(POINT_MASS.replace(after, f"{after}{line}\n", 1))
    assert error.where.endswith(line.partition(" =")[0])
    assert "point mass" in error.problem and "give [platform] an inertia" in error.hint


@pytest.mark.parametrize(
    ("table", "where"),
    (
        ("[effect.centre_of_mass]\nx = 0.01", "effect.centre_of_mass"),
        ("[effect.attachment]\nx = 0.01", "effect.attachment"),
        ("[effect.inertia]\nfactor_x = 1.2", "effect.inertia"),
        ("[effect.rotational_drag]\ndamping = 2.0", "effect.rotational_drag"),
        ("[effect.payload]\nmass = 2.0\nz = 0.1", "effect.payload.z"),
    ),
)
def test_a_point_mass_has_no_effects_of_a_rigid_body(table: str, where: str) -> None:
    error = refused(f"{POINT_MASS}\n{table}\n")
    assert error.where.endswith(f"robot.toml: {where}")
    assert "point mass" in error.problem and "give [platform] an inertia" in error.hint
    assert where.split(".")[1] in {setting.name for setting in read(f"{HEAD}{CABLES}\n{table}\n").effects}


def test_ropes_resist_motion_across_them_on_any_platform() -> None:
    for text in (POINT_MASS, HEAD + CABLES):
        assert read(f"{text}\n[effect.transverse_damping]\ndamping = 5.0\n").effects[0].values["damping"] == 5.0


def test_two_cables_are_enough_and_one_is_not() -> None:
    for text in (HEAD + CABLES, without_rigid_keys(HEAD + CABLES)):
        assert read(text).cable_count == 2
        error = refused(text[: text.rindex("[[cable]]")])
        assert error.problem == "1 given, a robot has two or more" and "for each cable" in error.hint


def without_rigid_keys(text: str) -> str:
    """The same file of a point mass."""
    return "\n".join(line for line in text.splitlines() if not line.startswith(("ine", "att")))


def test_cables_may_share_an_exit_point_but_not_the_attachment_too() -> None:
    shared = CABLES.replace("anchor = [3.0, 0.0, 4.0]", "anchor = [-3.0, 0.0, 4.0]")
    assert read(HEAD + shared).cable_count == 2
    assert "same attachment" in refused(HEAD + shared.replace("[0.5, 0.0, 0.0]", "[-0.5, 0.0, 0.0]")).problem
    at_attachment = CABLES.replace("anchor = [3.0, 0.0, 4.0]", "anchor = [0.5, 0.0, 1.0]")
    assert "its attachment" in refused(HEAD + at_attachment).problem


def test_check_reads_on_behind_each_error(tmp_path: Path) -> None:
    errors: list[RobotFileError] = []
    path = tmp_path / "robot.toml"
    path.write_text(HEAD.replace("0.1, 1.5", "0.3, 1.5") + "start_orientation = [2, 0, 0, 0]\n" + CABLES)
    read_robot_with_sink(path, errors.append)
    assert [error.where.rpartition(".")[2] for error in errors] == ["start_orientation", "inertia"]


@settings(max_examples=40, deadline=None)
@given(
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    moments=st.tuples(*[st.floats(1.0, 1.9)] * 3),
    uncertainty=st.floats(0.0, 1.0),
    point=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
)
def test_every_rigid_platform_is_written_and_read_back_equal(
    turn: tuple[float, ...], moments: tuple[float, ...], uncertainty: float, point: tuple[float, float, float]
) -> None:
    rotation = Rotation.from_rotvec(turn)
    x, y, z, w = rotation.as_quat().tolist()
    matrix = rotation.as_matrix() @ np.diag(moments) @ rotation.as_matrix().T
    rows = tuple(tuple(row) for row in (0.5 * (matrix + matrix.T)).tolist())
    robot = suspended_robot(3)
    platform = replace(
        robot.platform,
        inertia=rows,
        centre_of_mass=point,
        start_orientation=(w, x, y, z),
        inertia_uncertainty=uncertainty,
        centre_of_mass_uncertainty=uncertainty,
    )
    cables = (
        replace(robot.cables[0], swivel_axis=(0.6, 0.0, 0.8), attachment_uncertainty=uncertainty),
        *robot.cables[1:],
    )
    sensors = replace(robot.sensors, orientation_noise=uncertainty)
    written = read(robot_text(replace(robot, platform=platform, cables=cables, sensors=sensors)))
    again = read(robot_text(written))
    assert again == written
    assert written.platform.inertia == rows and written.platform.centre_of_mass == point
    assert written.platform.start_orientation == pytest.approx((w, x, y, z), abs=1e-15)
    assert (written.cables, written.sensors) == (cables, sensors)


def test_edited_files_keep_the_owner_s_comments(tmp_path: Path) -> None:
    source = tmp_path / "robot.toml"
    source.write_text(HEAD + CABLES, encoding="utf-8")
    robot = read_robot(source)
    platform = replace(robot.platform, inertia=((1.2, 0.1, 0.0), (0.1, 1.5, 0.0), (0.0, 0.0, 2.0)))
    platform = replace(platform, centre_of_mass=(0.0, 0.1, 0.0))
    changed = replace(
        robot, platform=platform, cables=(replace(robot.cables[0], attachment=(-0.4, 0.0, 0.0)), robot.cables[1])
    )
    text = edited_robot_text(source, changed, tmp_path / "out.toml")
    assert text is not None and "# from CAD" in text and "# bolt A" in text and "# weighed" in text
    write_robot(changed, tmp_path / "out.toml", source=source)
    assert read_robot(tmp_path / "out.toml") == changed


def test_a_swivel_axis_of_zeros_is_one_error_among_all(tmp_path: Path) -> None:
    path, problems = tmp_path / "robot.toml", list[str]()
    path.write_text(HEAD + CABLES + "swivel_axis = [0.0, 0.0, 0.0]\n", encoding="utf-8")
    read_robot_with_sink(path, lambda error: problems.append(error.problem))
    assert problems == ["has norm 0, must have 1 within 0.001"]


def test_a_swivel_axis_of_a_few_digits_is_written_and_read_back_as_a_unit_vector(tmp_path: Path) -> None:
    robot = underactuated_robot()
    write_robot(robot, tmp_path / "robot.toml")
    again = read_robot(tmp_path / "robot.toml")
    for cable, read in zip(robot.cables, again.cables, strict=True):
        assert np.linalg.norm(cable.swivel_axis) != 1.0
        assert np.linalg.norm(read.swivel_axis) == pytest.approx(1.0, abs=1e-15)
        assert replace(read, swivel_axis=cable.swivel_axis) == cable
        assert read.swivel_axis == pytest.approx(cable.swivel_axis, abs=1e-8)


def test_a_rigid_robot_reads_back_from_its_file(tmp_path: Path) -> None:
    write_robot(crane_robot(), tmp_path / "crane.toml")
    assert read_robot_with_sink(tmp_path / "crane.toml", lambda error: pytest.fail(str(error))) == crane_robot()
