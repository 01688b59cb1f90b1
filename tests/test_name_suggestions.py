"""What to write in place of a name that is not known."""

from __future__ import annotations

from pathlib import Path

import pytest

from tautwire.errors import RobotFileError
from tautwire.name_suggestions import suggest_name
from tautwire.recordings.recording_table import parse_header
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import fmu_slots
from tests.support.robots import EXAMPLES


@pytest.mark.parametrize(
    ("name", "known", "hint"),
    [
        ("gravty", ("name", "gravity"), "'gravity'"),
        ("MASS", ("mass", "start"), "'mass'"),
        ("colour", ("mass", "start"), "one of mass, start"),
        ("cable_9", fmu_slots(4), "one of platform, cable_1 ... cable_4, winch_1 ... winch_4"),
        ("cabel_2", fmu_slots(4), "'cable_2'"),
        ("cable_02", fmu_slots(4), "'cable_2'"),
        ("lqr", ("bob",), "'bob'"),
        ("a", (), "one that is known"),
    ],
)
def test_a_hint_names_what_is_likely_meant_or_all_that_is_known(name: str, known: tuple[str, ...], hint: str) -> None:
    assert suggest_name(name, known) == hint


@pytest.mark.parametrize(
    ("added", "message"),
    [
        (
            "[platform]\ncolour = 3\n",
            "platform.colour: is not a known key; write one of mass, start, mass_uncertainty, inertia, ",
        ),
        (
            "[fmu]\ncable_9 = 'a.fmu'\n[platform]\n",
            "fmu.cable_9: is not a known key; write one of platform, cable_1 ... ",
        ),
        ("[effect.rain]\nx = 1\n[platform]\n", "effect.rain: is not a known effect; write one of "),
    ],
)
def test_a_robot_file_with_an_unknown_key_gets_a_suggestion(tmp_path: Path, added: str, message: str) -> None:
    text = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
    place = tmp_path / "robot.toml"
    place.write_text(text.replace("[platform]\n", added), encoding="utf-8")
    with pytest.raises(RobotFileError) as caught:
        read_robot(place)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "hint"),
    [
        (["Time", "winch_speed_1"], "add it, rename 'Time', or declare its name"),
        (["time", "winch_speed1"], "add it, rename 'winch_speed1', or declare its name"),
        (["time", "motor_speed_2", "remark"], "declare their names"),
        (["time", f"winch_speed_{'9' * 5000}"], "declare their names"),
    ],
)
def test_a_missing_column_is_not_taken_for_one_of_another_cable(cells: list[str], hint: str) -> None:
    faults: list[str] = []
    parse_header(cells, "here", 1, lambda error: faults.append(error.hint))
    assert faults == [f"{hint} in [recording.columns], see tautwire columns"]
