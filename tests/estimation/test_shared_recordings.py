"""Recordings that lie beside the project, where they do; the project needs none of them."""

import pytest

from tautwire.estimation import Trace, trace
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import read_robot
from tests.support.folders import SHARED_RECORDINGS

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(not SHARED_RECORDINGS.is_dir(), reason="no shared recordings beside the project"),
]


def traced(name: str) -> Trace:
    folder = SHARED_RECORDINGS / name
    robot = read_robot(folder / "robot.toml")
    fit, check = (read_recording(folder / f"{role}.csv", robot.cable_count) for role in ("fit", "check"))
    return trace(robot, fit, check)


def test_what_exact_recordings_hide_is_named_alone_and_noise_is_left() -> None:
    """A pulley; of damping, tests/cli/test_commands.py says so."""
    result = traced("b")
    assert (result.verdict, [each.name for each in result.effects]) == ("effects", ["pulley"])
    check = result.comparisons[1]
    assert check.errors_after.position_rms < 1.2 * result.noise_floor.position_rms
    assert check.errors_after.tension_rms < 1.2 * result.noise_floor.tension_rms


def test_where_nothing_is_hidden_nothing_is_named() -> None:
    assert traced("d").verdict == "none"


@pytest.mark.parametrize(("name", "effect"), [("p2", "pulley"), ("p3", "hysteresis"), ("p6", "friction")])
def test_on_robots_as_they_are_what_is_hidden_is_named_alone(name: str, effect: str) -> None:
    result = traced(f"lifelike/{name}")
    assert (result.verdict, [each.name for each in result.effects]) == ("effects", [effect])


def test_a_real_robot_without_load_cells_has_drums_each_of_its_own_radius() -> None:
    result = traced("real-planar")
    assert result.verdict == "effects"
    assert [(each.name, each.cables) for each in result.effects] == [("drum", (cable,)) for cable in (1, 2, 3, 4)]
    ratios = [each.parameters["radius_ratio"].value for each in result.effects]
    assert all(0.935 < ratio < 0.944 for ratio in ratios), ratios
    check = result.comparisons[1]
    assert check.errors_after.position_rms < check.errors_before.position_rms / 6.0
