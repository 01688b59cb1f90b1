"""Formulas in robot files: read, written, and refused with their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tautwire.errors import RobotFileError
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import Formula, Robot
from tests.support.robots import example

ROBOT = example("three")


def with_table(folder: Path, table: str) -> Robot:
    path = folder / "robot.toml"
    path.write_text(robot_text(ROBOT) + "\n" + table + "\n", encoding="utf-8")
    return read_robot(path)


def test_a_table_is_read_place_by_place(tmp_path: Path) -> None:
    robot = with_table(tmp_path, '[formula]\nforce_y = "-31.2*vx"\ntension = "4*travel"\ncables = [2]\n')
    assert robot.formulas == (Formula("tension", "4*travel", (2,)), Formula("force_y", "-31.2*vx"))


def test_without_cables_a_tension_acts_in_all(tmp_path: Path) -> None:
    assert with_table(tmp_path, '[formula]\ntension = "4*travel"').formulas[0].cables == (1, 2, 3)


@pytest.mark.parametrize(
    "formulas",
    [
        (Formula("force_x", "-2*vy"), Formula("force_y", "2*vx"), Formula("mass", "0.1*time")),
        (Formula("tension", "1e3*strain**2", (1, 2, 3)), Formula("tension", "2*travel", (3,))),
        (Formula("force_z", "3"), Formula("tension", "2*travel", (1, 2)), Formula("force_z", "time")),
    ],
)
def test_what_is_written_reads_back_equal(formulas: tuple[Formula, ...], tmp_path: Path) -> None:
    robot = replace(ROBOT, formulas=formulas)
    write_robot(robot, tmp_path / "robot.toml")
    assert read_robot(tmp_path / "robot.toml") == robot


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('[formula]\nforce_x = "-2*strain"', ("formula.force_x", "character 4", "strain", "vx")),
        ('[formula]\nmass = "x"', ("formula.mass", "character 1", "time")),
        ("[formula]\nforce_x = \"__import__('os')\"", ("formula.force_x", "character 1")),
        ("[formula]\nforce_x = 3.0", ("formula.force_x",)),
        ('[formula]\nforce_q = "3"', ("formula.force_q", "not a known key")),
        ('[formula]\nforce_x = "3"\ncables = [1]', ("formula.cables", "remove")),
        ('[formula]\ntension = "3"\ncables = [4]', ("formula.cables", "1 to 3")),
        ("[formula]", ("formula", "force_x")),
    ],
)
def test_what_is_no_formula_is_refused(table: str, words: tuple[str, ...], tmp_path: Path) -> None:
    with pytest.raises(RobotFileError) as caught:
        with_table(tmp_path, table)
    assert all(word in str(caught.value) for word in words)
    assert "\n" not in str(caught.value)


def test_open_numbers_are_not_written(tmp_path: Path) -> None:
    robot = replace(ROBOT, formulas=(Formula("force_x", "c1*vx", (), {"c1": 2.0}),))
    with pytest.raises(RobotFileError):
        write_robot(robot, tmp_path / "robot.toml")


@pytest.mark.parametrize("text", ["-20*vx/sqrt(vx**2 + vy**2)", "log(vx)", "1/(x - 28.86)"])
def test_a_force_without_a_value_at_the_start_at_rest_is_refused(text: str, tmp_path: Path) -> None:
    """Statics and co-simulation would divide by zero."""
    assert ROBOT.platform.start[0] == 28.86
    with pytest.raises(RobotFileError, match=r"formula\.force_x: .* has no value at the start, at rest"):
        with_table(tmp_path, f'[formula]\nforce_x = "{text}"')
