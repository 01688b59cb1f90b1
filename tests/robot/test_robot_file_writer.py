"""Robots as values, and written as files: nothing is lost, and nothing wrong is written."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tautwire.errors import RobotFileError
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import (
    PER_CABLE_COMPONENTS,
    Cable,
    EffectSetting,
    Platform,
    Robot,
    Sensors,
    TensionLimits,
    UserFmu,
    Winch,
    fmu_slots,
)
from tautwire_fmu.laws.cable import LAWS
from tautwire_fmu.laws.effects import ALL, Effect, Parameter
from tests.support.robots import example

HALL = Robot(
    name="hall",
    gravity=9.81,
    platform=Platform(80.0, (10.0, 5.5, 4.0)),
    tension=None,
    sensors=Sensors(position_noise=1.5e-4),
    cables=tuple(
        Cable(anchor, 6.0e10, 3.2e-6, 4.0e8, "logarithmic")
        for anchor in ((0.0, 0.0, 12.0), (20.0, 0.0, 12.0), (10.0, 16.0, 12.0))
    ),
)


def test_written_text_is_commented() -> None:
    robot = HALL.with_effect(EffectSetting("modulus", {"modulus": 5e10}, (2,)))
    text = robot_text(robot)
    assert "mass = 80.0  # kg" in text
    assert "[effect.modulus]" in text
    assert "cables = [2]" in text


def test_native_fmus_are_written_and_read_back(tmp_path: Path) -> None:
    robot = replace(example("three"), native_fmus=True)
    target = tmp_path / "three.toml"
    write_robot(robot, target)
    assert "native = true" in target.read_text(encoding="utf-8")
    assert read_robot(target).native_fmus
    assert "[fmu]" not in robot_text(example("three"))


def test_writing_replaces_whole_files_only(tmp_path: Path) -> None:
    target = tmp_path / "out.toml"
    write_robot(HALL, target)
    before = target.read_bytes()
    with pytest.raises(RobotFileError, match=r"cable\[1\]\.modulus"):
        write_robot(replace(HALL, cables=(replace(HALL.cables[0], modulus=-1.0), *HALL.cables[1:])), target)
    assert target.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.toml"]


def test_writing_into_no_folder_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        write_robot(HALL, tmp_path / "absent" / "out.toml")
    assert not list(tmp_path.iterdir())


def test_effect_on_a_cable_that_the_robot_lacks_is_not_written(tmp_path: Path) -> None:
    robot = HALL.with_effect(EffectSetting("damping", {"damping": 1.0}, (7,)))
    with pytest.raises(RobotFileError, match=r"effect\.damping\.cables"):
        write_robot(robot, tmp_path / "out.toml")


def test_with_effect_replaces_the_same_effect_on_the_same_cables() -> None:
    payload = EffectSetting("payload", {"mass": 2.0})
    robot = HALL.with_effect(EffectSetting("damping", {"damping": 1.0}, (1, 2))).with_effect(payload)
    changed = robot.with_effect(EffectSetting("damping", {"damping": 2.0}, (2, 1)))
    assert changed.effects == (EffectSetting("damping", {"damping": 2.0}, (1, 2)), payload)
    assert robot.effects[0].values["damping"] == 1.0
    assert changed.without_effects() == HALL


def test_winches_and_users_fmus_are_no_part_of_the_model() -> None:
    own = UserFmu("winch_2", Path("/models/a.fmu"))
    robot = replace(HALL, winch=Winch(0.1)).with_fmus([own, UserFmu("platform", Path("/models/b.fmu"))])
    assert robot.as_modelled() == HALL
    assert robot.winch_numbers == (1, 2, 3)
    assert HALL.with_fmus([own]).winch_numbers == (2,)
    again = HALL.with_fmus([own]).with_fmus([UserFmu("winch_2", Path("/models/c.fmu"))])
    assert again.fmus == (UserFmu("winch_2", Path("/models/c.fmu")),)


def test_with_effect_wins_on_the_cables_that_it_names() -> None:
    robot = HALL.with_effect(EffectSetting("modulus", {"modulus": 5e10}, (1, 2, 3)))
    changed = robot.with_effect(EffectSetting("modulus", {"modulus": 7e10}, (2,)))
    assert changed.effects == (
        EffectSetting("modulus", {"modulus": 5e10}, (1, 3)),
        EffectSetting("modulus", {"modulus": 7e10}, (2,)),
    )


def test_settings_are_values() -> None:
    numbers = {"a": 1.0, "b": 2.0}
    setting = EffectSetting("relaxation", numbers, (1,))
    numbers["a"] = 5.0
    assert setting == EffectSetting("relaxation", {"b": 2.0, "a": 1.0}, (1,))
    assert hash(setting) == hash(EffectSetting("relaxation", {"b": 2.0, "a": 1.0}, (1,)))
    assert len({HALL, replace(HALL)}) == 1
    with pytest.raises(KeyError):
        setting.values["c"]


SMALL = st.floats(-1e4, 1e4)
POSITIVE = st.floats(1e-12, 1e13)
NOT_NEGATIVE = st.floats(0.0, 1e13)
BANDWIDTH, RATIO, LIMIT = st.floats(0.01, 1000.0), st.floats(0.05, 20.0), st.none() | POSITIVE
FILES = st.text(st.characters(exclude_categories=("C", "Z"), exclude_characters="/"), min_size=1, max_size=20).map(
    lambda name: Path(os.path.abspath(f"/models/{name}.fmu"))
)
NAMES = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=20)


def values_of(effect: Effect, moves_tracker: bool = True) -> st.SearchStrategy[dict[str, float]]:
    """Values that leave the platform a mass; one setting alone of an effect may move the tracker."""

    def value(parameter: Parameter) -> st.SearchStrategy[float | None]:
        if parameter.needs_rigid_body or (parameter.name.startswith("position_") and not moves_tracker):
            return st.just(parameter.neutral)
        minimum = 0.0 if effect.name == "payload" else parameter.minimum
        return st.floats(minimum, parameter.maximum)

    return st.fixed_dictionaries({parameter.name: value(parameter) for parameter in effect.parameters})


@st.composite
def effect_settings(draw: st.DrawFn, cable_count: int) -> list[EffectSetting]:
    """Settings as files of point masses may hold them: each effect at most once for each cable."""
    drawn: list[EffectSetting] = []
    of_point_masses = [effect for effect in ALL if not effect.needs_rigid_body]
    for effect in draw(st.lists(st.sampled_from(of_point_masses), unique=True, max_size=3)):
        if effect.component not in PER_CABLE_COMPONENTS:
            drawn.append(EffectSetting(effect.name, draw(values_of(effect))))
            continue
        shares = draw(st.lists(st.integers(0, 2), min_size=cable_count, max_size=cable_count))
        groups = [tuple(i for i, share in enumerate(shares, 1) if share == group) for group in (1, 2)]
        for number, group in enumerate(group for group in groups if group):
            drawn.append(EffectSetting(effect.name, draw(values_of(effect, number == 0)), group))
    return draw(st.permutations(drawn))


@st.composite
def robots(draw: st.DrawFn) -> Robot:
    """Robots as files may declare them."""
    count = draw(st.integers(3, 6))
    apart = st.lists(st.integers(-9999, 9999), min_size=count + 1, max_size=count + 1, unique=True)
    start, *anchors = [(float(x), draw(SMALL), draw(SMALL)) for x in draw(apart)]
    low, middle, high = sorted(draw(st.lists(POSITIVE, min_size=3, max_size=3)))
    cables = [
        Cable(anchor, draw(POSITIVE), draw(POSITIVE), draw(NOT_NEGATIVE), draw(st.sampled_from(sorted(LAWS))))
        for anchor in anchors
    ]
    noise = st.none() | NOT_NEGATIVE
    return Robot(
        name=draw(NAMES),
        gravity=draw(NOT_NEGATIVE),
        platform=Platform(draw(POSITIVE), start),
        tension=draw(st.sampled_from([None, TensionLimits(low, high, middle)])),
        sensors=Sensors(draw(noise), draw(noise), draw(noise)),
        cables=tuple(cables),
        effects=tuple(draw(effect_settings(count))),
        winch=draw(st.none() | st.builds(Winch, POSITIVE, POSITIVE, BANDWIDTH, RATIO, LIMIT, LIMIT)),
        fmus=tuple(
            UserFmu(slot, draw(FILES)) for slot in draw(st.lists(st.sampled_from(fmu_slots(count)), unique=True))
        ),
    )


def test_an_absent_effect_is_written_by_its_first_parameter_whatever_the_order_of_its_values(tmp_path: Path) -> None:
    """A point mass may have a payload, but not a place of it."""
    robot = HALL.with_effect(EffectSetting("payload", {"x": 0.0, "mass": 0.0, "y": 0.0, "z": 0.0}))
    write_robot(robot, tmp_path / "robot.toml")
    assert read_robot(tmp_path / "robot.toml") == robot


@settings(max_examples=100, deadline=None)
@given(robot=robots())
def test_written_robots_read_back_equal(tmp_path_factory: pytest.TempPathFactory, robot: Robot) -> None:
    path = tmp_path_factory.getbasetemp() / "round trip.toml"
    write_robot(robot, path)
    assert read_robot(path) == robot
