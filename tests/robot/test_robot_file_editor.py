"""Edited robot files read back as the robot they were edited for, and keep what their owner wrote."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tautwire.provenance import Provenance
from tautwire.robot.robot_file_editor import edited_robot_text
from tautwire.robot.robot_file_reader import read_robot, robot_from_text
from tautwire.robot.robot_file_text import completed_robot
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import EffectSetting, Formula, Robot, UserFmu
from tests.support.robots import EXAMPLES

SHIPPED = sorted(EXAMPLES.glob("*/robot.toml"))
PROVENANCE = Provenance("0.1.0", "tautwire trace robot.toml", "2026-01-02T03:04:05Z", {"robot.toml": "ab" * 32})
CABLES = """
[[cable]]
anchor = [0, 0, 12]  # above the door
modulus = 60_000_000_000
area = 3.2e-6
law = "logarithmic"

# This one was replaced in spring.
[[cable]]
law = 'linear'
anchor = [20.0, 0.0, 12.0]
modulus = 6e10
area = 3.2e-6

[[cable]]
anchor = [
  10.0,
  16.0,  # measured twice
  12.0,
]
modulus = 6e10
area = 3.2e-6
law = "logarithmic"
"""
HEAD = """# Owner's notes
platform = {mass = 80, start = [10.0, 5.5, 4.0]}  # with gripper
"""
FILES = {
    "nameless": HEAD + CABLES,
    "dotted keys": "platform.mass = 80  # with gripper\nplatform.start = [10.0, 5.5, 4.0]\n" + CABLES,
    "effects": HEAD
    + """
[[effect.modulus]]
modulus = 5e10
cables = [1]
# kept for cable 3
[[effect.modulus]]
modulus = 5.5e10
cables = [3]
[effect.payload]
mass = 1.5  # the camera
[effect.friction]
coefficient = 0.1  # guessed
wrap = 1.5708
[formula]
force_x = "-20 * vx"  # a brush
"""
    + CABLES,
    "winches": HEAD + '[winch]\ndrum_radius = 0.1\n[fmu]\nplatform = "own.fmu"  # ours\n' + CABLES,
    "lifelike": HEAD
    + """[sensors]
position_noise = 1e-4  # laser
tension_offset_uncertainty = 20.0
[effect.sensor_offset]
tension_offset = 3.0
cables = [2]
"""
    + CABLES,
}


def owner_comments(text: str) -> list[str]:
    return [line[line.index("#") :].strip() for line in text.splitlines() if "#" in line]


def changes(robot: Robot) -> dict[str, Robot]:
    """What commands make of a robot."""
    cables = (replace(robot.cables[0], modulus=1.0 / 3.0 * 1e11, damping=7.0), *robot.cables[1:])
    return {
        "unchanged": robot,
        "cables": replace(robot, cables=cables),
        "platform": replace(robot, platform=replace(robot.platform, mass=81.25)),
        "new effect": robot.with_effect(EffectSetting("drag", {"drag_area": 0.7})),
        "changed effect": robot.with_effect(EffectSetting("payload", {"mass": 2.25})),
        "effect in two tables": robot.with_effect(EffectSetting("damping", {"damping": 3e8}, (1,))).with_effect(
            EffectSetting("damping", {"damping": 4e8}, (2,))
        ),
        "effect on one cable": robot.with_effect(EffectSetting("modulus", {"modulus": 7e10}, (2,))),
        "formula": replace(robot, formulas=(*robot.formulas, Formula("force_y", "-3 * vy"))),
        "no effects": robot.without_effects(),
        "own FMU": robot.with_fmus([UserFmu("cable_1", Path("/models/rope.fmu"))]),
    }


@pytest.mark.parametrize("name", FILES)
def test_edited_files_read_back_equal_with_the_owner_s_comments(tmp_path: Path, name: str) -> None:
    source, target = tmp_path / "owner" / "hall.toml", tmp_path / "robot.toml"
    source.parent.mkdir()
    source.write_text(FILES[name], encoding="utf-8")
    for change, robot in changes(read_robot(source)).items():
        edited = edited_robot_text(source, robot, target)
        assert edited is not None, change
        assert robot_from_text(edited, target, "robot") == completed_robot(robot), change
        if "effect" not in change and change != "formula":
            kept = {"# Owner's notes", "# above the door", "# This one was replaced in spring.", "# with gripper"}
            assert kept & {*owner_comments(FILES[name])} <= {*owner_comments(edited)}, change


@pytest.mark.parametrize("source", SHIPPED, ids=lambda path: path.parent.name)
def test_shipped_robots_keep_every_comment_and_their_order(tmp_path: Path, source: Path) -> None:
    text, target = source.read_text(encoding="utf-8"), tmp_path / "robot.toml"
    for change, robot in changes(read_robot(source)).items():
        write_robot(robot, target, PROVENANCE, source)
        assert read_robot(target) == completed_robot(robot), change
        edited = target.read_text(encoding="utf-8")
        assert edited.startswith(PROVENANCE.comment())
        comments = iter(owner_comments(edited))
        assert [each for each in owner_comments(text) if each not in comments] == [], change
    write_robot(read_robot(source), target, PROVENANCE, source)
    assert target.read_text(encoding="utf-8") == f"{PROVENANCE.comment()}\n{text}"


def test_a_file_that_was_written_before_gets_one_provenance(tmp_path: Path) -> None:
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    write_robot(read_robot(SHIPPED[0]), first, PROVENANCE, SHIPPED[0])
    write_robot(read_robot(first), second, replace(PROVENANCE, created="2026-06-01T00:00:00Z"), first)
    assert second.read_text(encoding="utf-8") == first.read_text(encoding="utf-8").replace(
        PROVENANCE.created, "2026-06-01T00:00:00Z"
    )


def test_windows_line_ends_are_kept(tmp_path: Path) -> None:
    source, target = tmp_path / "hall.toml", tmp_path / "robot.toml"
    source.write_bytes(FILES["effects"].replace("\n", "\r\n").encode())
    robot = read_robot(source).with_effect(EffectSetting("drag", {"drag_area": 0.7}))
    write_robot(robot, target, PROVENANCE, source)
    assert read_robot(target) == completed_robot(robot)
    assert b"\n" not in target.read_bytes().replace(b"\r\n", b"")


@pytest.mark.parametrize("content", [None, b"not = a = robot", b"\xff\xfe"])
def test_without_a_source_that_can_be_read_the_robot_is_written_anew(tmp_path: Path, content: bytes | None) -> None:
    source, target = tmp_path / "hall.toml", tmp_path / "robot.toml"
    if content is not None:
        source.write_bytes(content)
    robot = read_robot(SHIPPED[0])
    write_robot(robot, target, source=source)
    assert read_robot(target) == robot
