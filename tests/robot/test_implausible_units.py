"""Numbers that no robot has are told with the unit in which they were probably written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.robot.implausible_units import implausible_units
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Robot, TensionLimits
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES, example


def with_cables(robot: Robot, **changes: Any) -> Robot:
    return replace(robot, cables=tuple(replace(cable, **changes) for cable in robot.cables))


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_shipped_robots_are_plausible(name: str) -> None:
    assert list(implausible_units(example(name), "robot.toml")) == []


@pytest.mark.parametrize(
    ("changes", "key", "hint"),
    [
        ({"modulus": 100.0}, "modulus", "in GPa as 1e+11"),
        ({"modulus": 2.5}, "modulus", "in GPa as 2.5e+09"),
        ({"modulus": 9.5e4}, "modulus", "in MPa as 9.5e+10"),
        ({"area": 3.0}, "area", "in mm^2 as 3e-06"),
        ({"area": 4.0}, "area", "if this is the diameter in mm as 1.25664e-05"),
        ({"area": 0.2}, "area", "if this is in cm^2 as 2e-05"),
        ({"modulus": 1.5e7}, "modulus", "write it in Pa, if this is in psi as 1.03421e+11"),
        ({"modulus": 1e6, "area": 1e-5}, "modulus", "if this is E A in N as 1e+11"),
        ({"area": 0.004}, "area", "the diameter in m as 1.25664e-05"),
        ({"anchor": (0.0, 0.0, 12000.0)}, "anchor", "in mm multiply by 0.001"),
        ({"modulus": 1e9, "damping": 39e9}, "damping", "write it in Pa s"),
        ({"anchor_uncertainty": 2.0}, "anchor_uncertainty", "in mm multiply by 0.001"),
    ],
)
def test_each_cable_is_told_with_the_unit(changes: dict[str, Any], key: str, hint: str) -> None:
    robot = with_cables(example("caroca"), **changes)
    errors = list(implausible_units(robot, "robot.toml"))
    assert [error.where for error in errors] == [f"robot.toml: cable[{number}].{key}" for number in robot.cable_numbers]
    assert all(hint in error.hint for error in errors)
    assert [error.key_path for error in errors] == [("cable", index, key) for index in range(robot.cable_count)]


def test_a_start_in_mm_is_told() -> None:
    robot = example("caroca")
    robot = replace(robot, platform=replace(robot.platform, start=(1000.0, 0.0, 2500.0)))
    (error,) = implausible_units(robot, "robot.toml")
    assert error.where == "robot.toml: platform.start" and "2500 m" in error.problem


def test_modes_that_no_robot_has_are_told_in_khz() -> None:
    robot = with_cables(example("caroca"), area=1e-4, modulus=4e14)
    robot = replace(robot, platform=replace(robot.platform, mass=1.0))
    (error,) = implausible_units(robot, "robot.toml")
    assert "kHz" in error.problem and "modulus (Pa)" in error.hint


def test_a_damping_ratio_that_no_robot_has_is_told() -> None:
    robot = with_cables(example("caroca"), area=5e-6, modulus=1e11, damping=1.9e11)
    robot = replace(robot, platform=replace(robot.platform, mass=1.0))
    (error,) = implausible_units(robot, "robot.toml")
    assert error.key_path == ("cable", 0, "damping") and "damping ratios of up to" in error.problem


def test_a_modulus_in_gpa_and_an_area_in_mm2_are_both_told() -> None:
    robot = with_cables(example("caroca"), modulus=100.0, area=3.0)
    errors = list(implausible_units(robot, "robot.toml"))
    hints = {error.key_path[-1]: error.hint for error in errors}
    assert hints.keys() == {"modulus", "area"} and len(errors) == 2 * robot.cable_count
    assert "in GPa as 1e+11" in hints["modulus"] and "in mm^2 as 3e-06" in hints["area"]


def test_a_soft_rope_with_much_damping_is_plausible() -> None:
    """Polymer ropes, rubber, springs, and ropes as good as rigid: whoever has such a robot is not refused."""
    for modulus, area in ((2e8, 8e-6), (2e6, 8e-4), (5e5, 0.01), (1e13, 1e-6)):
        robot = with_cables(example("caroca"), modulus=modulus, damping=0.1 * modulus, area=area)
        assert list(implausible_units(robot, "robot.toml")) == []


@pytest.mark.parametrize(("diameter", "load"), [(0.0005, 3.0), (0.002, 30.0), (0.004, 300.0), (0.008, 5000.0)])
def test_a_diameter_is_told_where_its_area_is_not(diameter: float, load: float) -> None:
    """Steel and polymer ropes of a table-top robot and of a hall."""
    robot = example("caroca")
    robot = replace(robot, platform=replace(robot.platform, mass=load * robot.cable_count / robot.gravity))
    for modulus in (5e9, 1e11):
        area = 0.25 * np.pi * diameter**2
        assert list(implausible_units(with_cables(robot, modulus=modulus, area=area), "robot.toml")) == []
        errors = list(implausible_units(with_cables(robot, modulus=modulus, area=diameter), "robot.toml"))
        assert {error.where.split("].")[-1] for error in errors} == {"area"}


def test_an_area_in_mm2_that_is_no_diameter_is_told() -> None:
    light = example("caroca")
    light = replace(light, platform=replace(light.platform, mass=0.5))
    errors = list(implausible_units(with_cables(light, area=0.0079), "robot.toml"))
    assert len(errors) == 3 and all(error.hint.endswith("m^2, if this is in mm^2 as 7.9e-09") for error in errors)


@pytest.mark.parametrize(
    ("name", "mass", "told"),
    [
        ("caroca", 600.0, "would stretch all 3 ropes together to twice their length (E A is "),
        ("eight", 40.0, "more than the 3.2e+04 N that all 8 ropes together may bear by tension.maximum"),
    ],
)
def test_a_mass_in_g_is_told_and_not_the_ropes(name: str, mass: float, told: str) -> None:
    robot = example(name)
    robot = replace(robot, platform=replace(robot.platform, mass=1e3 * mass))
    (error,) = implausible_units(robot, "robot.toml")
    assert error.where == "robot.toml: platform.mass" and told in error.problem
    assert f"if this is in g as {mass:g}, or compare" in error.hint


def test_areas_that_were_converted_twice_are_told_and_not_the_mass() -> None:
    robot = example("caroca")
    first, *others = robot.cables
    (error,) = implausible_units(replace(robot, cables=(replace(first, area=1e-6 * first.area), *others)), "robot.toml")
    assert error.where == "robot.toml: cable[1].area"
    assert error.hint == f"write it in m^2, if it was converted from mm^2 twice as {first.area:g}"
    (error,) = implausible_units(with_cables(robot, area=1e-6 * first.area), "robot.toml")
    assert error.hint == "write it in kg, or compare modulus, area and tension.maximum"


def test_a_thick_rope_of_a_large_crane_is_plausible() -> None:
    robot = replace(example("eight"), tension=TensionLimits(minimum=1e3, maximum=1e6, preferred=1e5))
    assert list(implausible_units(with_cables(robot, modulus=1.1e11, area=1.66e-3), "robot.toml")) == []


def test_a_file_in_gpa_is_told_by_check_and_trace_alike(tmp_path: Path) -> None:
    from tautwire.cli.console import read_plausible_robot
    from tautwire.cli.input_checks import check_files
    from tautwire.errors import RobotFileError

    text = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
    modulus = read_robot(EXAMPLES / "three" / "robot.toml").cables[0].modulus
    lines = ["modulus = 102.0" if line.startswith("modulus =") else line for line in text.split("\n")]
    file = tmp_path / "robot.toml"
    file.write_text("\n".join(lines), encoding="utf-8")
    assert modulus > 1e9
    problem, *others = check_files(file).problems
    assert len(others) == 2 and lines[int(problem.line or 0) - 1].startswith("modulus")
    with pytest.raises(RobotFileError) as caught:
        read_plausible_robot(file)
    assert caught.value.problem == problem.problem and caught.value.hint == problem.hint


def test_a_rigid_platform_larger_than_its_frame_is_in_millimetres() -> None:
    robot = crane_robot()
    assert not list(implausible_units(robot, "robot.toml"))
    attachment = replace(robot.cables[2], attachment=(-500.0, -270.0, 0.0))
    (error,) = implausible_units(
        replace(robot, cables=(*robot.cables[:2], attachment, *robot.cables[3:])), "robot.toml"
    )
    assert error.where == "robot.toml: cable[3].attachment" and "mm" in error.hint
    frame = max(np.linalg.norm(np.subtract(cable.anchor, robot.platform.start)) for cable in robot.cables)
    within, far = (replace(robot.platform, centre_of_mass=(0.0, 0.0, share * frame)) for share in (0.9, 1.1))
    assert not list(implausible_units(replace(robot, platform=within), "robot.toml"))
    (error,) = implausible_units(replace(robot, platform=far), "robot.toml")
    assert error.where == "robot.toml: platform.centre_of_mass"
    heavy = replace(robot, platform=replace(robot.platform, inertia=((36.6e6, 0, 0), (0, 33.2e6, 0), (0, 0, 20.1e6))))
    (error,) = implausible_units(heavy, "robot.toml")
    assert error.where == "robot.toml: platform.inertia" and "kg mm^2" in error.hint


@pytest.mark.parametrize(("factor", "cause"), [(1e4, "from its centre"), (1e-6, "turn on its ropes at up to")])
def test_an_inertia_in_another_unit_is_told(factor: float, cause: str) -> None:
    robot = example("cogiro")
    assert robot.platform.inertia is not None and not list(implausible_units(robot, "robot.toml"))
    inertia = tuple(tuple(factor * entry for entry in row) for row in robot.platform.inertia)
    errors = list(implausible_units(replace(robot, platform=replace(robot.platform, inertia=inertia)), "robot.toml"))
    assert errors[0].where == "robot.toml: platform.inertia" and cause in errors[0].problem
