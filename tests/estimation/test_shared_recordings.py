"""Recordings that lie beside the project, where they do; the project needs none of them."""

from math import pi

import pytest

from tautwire.estimation import Trace, trace
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import read_robot
from tests.support.folders import SHARED_RECORDINGS as FOLDER

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(not FOLDER.is_dir(), reason="no shared recordings beside the project"),
]


def traced(name: str) -> Trace:
    robot = read_robot(FOLDER / name / "robot.toml")
    fit, check = (read_recording(FOLDER / name / f"{role}.csv", robot.cable_count) for role in ("fit", "check"))
    return trace(robot, fit, check, lambda what, done: None)


def test_a_lacks_damping() -> None:
    found = traced("a")
    assert [effect.name for effect in found.effects] == ["damping"]
    check = found.comparisons[1]
    assert check.errors_after.position_rms < 1.2 * found.noise_floor.position_rms
    assert check.errors_after.tension_rms < 1.2 * found.noise_floor.tension_rms


def test_d_lacks_nothing() -> None:
    assert traced("d").verdict == "none"


@pytest.mark.parametrize(
    ("name", "effects"), [("p1", []), ("p2", ["pulley"]), ("p3", ["hysteresis"]), ("p6", ["friction"])]
)
def test_on_robots_as_they_are_what_is_hidden_is_named_alone(name: str, effects: list[str]) -> None:
    found = traced(f"lifelike/{name}")
    assert found.verdict == ("effects" if effects else "none")
    assert [effect.name for effect in found.effects] == effects


def test_a_swinging_load_on_a_robot_as_it_is_gets_no_listed_name() -> None:
    found = traced("lifelike/p4")
    assert found.verdict == "unexplained"
    assert found.effects == ()
    # 60 kg on a string of 2 m.
    assert [each.frequency for each in found.resonances] == pytest.approx([(9.81 / 2.0) ** 0.5 / (2.0 * pi)], rel=0.03)


def test_of_a_real_planar_robot_the_drums_are_named_alone_and_the_error_falls_to_a_sixth() -> None:
    """Geometry and the encoders' lengths alone give ratios of 0.936 to 0.943."""
    found = traced("real-planar")
    assert found.verdict == "effects"
    assert {effect.name for effect in found.effects} == {"drum"}
    assert sorted(cable for effect in found.effects for cable in effect.cables) == [1, 2, 3, 4]
    ratios = [effect.parameters["radius_ratio"] for effect in found.effects]
    assert all(0.92 < ratio.value < 0.97 and ratio.low < 0.945 for ratio in ratios)
    check = found.comparisons[-1]
    assert check.errors_after.position_rms < check.errors_before.position_rms / 6.0
