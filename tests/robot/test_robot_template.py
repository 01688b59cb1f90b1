"""The robot file to begin with: it reads back, is held by its cables, runs, and names every key."""

import re
from pathlib import Path

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.robot import robot_file_reader as reading
from tautwire.robot.platform_reader import CABLE_KEYS, PLATFORM_KEYS
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_template import MAX_TEMPLATE_CABLES, MIN_TEMPLATE_CABLES, new_robot_text
from tautwire.robot.static_equilibrium import static_tensions
from tautwire_fmu.laws.effects import ALL


@pytest.mark.parametrize("count", range(MIN_TEMPLATE_CABLES, MAX_TEMPLATE_CABLES + 1))
def test_it_reads_back_and_rests(tmp_path: Path, count: int) -> None:
    place = tmp_path / "robot.toml"
    place.write_text(new_robot_text('the "hall"', count), encoding="utf-8")
    robot = read_robot(place)
    assert (robot.name, robot.cable_count) == ('the "hall"', count)
    assert robot.tension is not None
    tensions = static_tensions(robot)
    assert np.all(tensions > robot.tension.minimum) and np.all(tensions < robot.tension.maximum)


@pytest.mark.validate(but=["3"])
@pytest.mark.parametrize("count", [3, 6])
def test_it_simulates(tmp_path: Path, count: int) -> None:
    place = tmp_path / "robot.toml"
    place.write_text(new_robot_text("hall", count), encoding="utf-8")
    robot = read_robot(place)
    time = np.linspace(0.0, 0.5, 51)
    motion = cosimulate(build_fmus(robot, tmp_path), time, np.full((51, count), 0.0))
    assert np.abs(motion.position - robot.platform.start).max() < 1e-6


def test_what_is_commented_out_can_be_put_in(tmp_path: Path) -> None:
    text = re.sub(r"^# (?=\[|[a-z_]+ = )", "", new_robot_text("hall", 4), flags=re.MULTILINE)
    place = tmp_path / "robot.toml"
    place.write_text(text.replace("[fmu]\nplatform = ", "[fmu]\n# platform = "), encoding="utf-8")
    robot = read_robot(place)
    assert robot.winch and robot.effects and robot.formulas
    assert robot.tracker.clock_offset == 3.412 and robot.tracker.columns
    assert robot.tension and robot.tension.preferred_uncertainty


def test_every_table_is_in_it() -> None:
    text = new_robot_text("hall")
    for key in reading.TOP_LEVEL_KEYS:
        assert re.search(rf"^(# )?(\[*{key}[\].]|{key} = )", text, re.MULTILINE), key
    keys = (*reading.NOISE_RULES, *reading.OFFSET_RULES, *reading.WINCH_LIMIT_RULES, *reading.CABLE_UNCERTAINTY_RULES)
    for key in (*keys, "inertia", *PLATFORM_KEYS, *CABLE_KEYS, "swivel_axis"):
        assert re.search(rf"^(# )?{key} = ", text, re.MULTILINE), key
    for effect in ALL:
        assert re.search(rf"^# .*\b{effect.name}\b", text, re.MULTILINE), effect.name


def test_the_command_never_overwrites_without_the_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "hall"]) == 0
    before = (tmp_path / "hall.toml").read_bytes()
    assert run(["new", "hall", "--cables", "8"]) == 2
    assert "add --overwrite" in capsys.readouterr().err
    assert (tmp_path / "hall.toml").read_bytes() == before
    assert run(["new", "hall.toml", "--cables", "8", "--overwrite"]) == 0
    assert read_robot("hall.toml").cable_count == 8
    assert [path.name for path in tmp_path.iterdir()] == ["hall.toml"]
