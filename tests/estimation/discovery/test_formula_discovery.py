"""Formulas of what the rig hides and no list names; and none where nothing is hidden."""

from __future__ import annotations

import re
from dataclasses import replace
from math import log
from typing import Any

import pytest

from tautwire.estimation.discovery.candidate_terms import formula_text
from tautwire.estimation.discovery.formula_discovery import Discovery, discover_formula
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.robot.schema import Formula, Robot
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
AXIAL = ROBOT.cables[0].modulus * ROBOT.cables[0].area
THRESHOLD = log(100 / 0.01)


def discovered(effects: dict[str, Any], seed: int = 3, robot: Robot = ROBOT) -> Discovery | None:
    fit, check = recorded("three", seed, effects), recorded("three", seed + 50, effects)
    noise = estimate_noise(robot, fit)
    return discover_formula(robot, (), Fitter(noise), split_data(robot, noise, fit, check), lambda what, done: None)


def found_in(effects: dict[str, Any], pattern: str) -> list[float]:
    """The numbers in a formula of this form, which has to be good enough for a verdict."""
    result = discovered(effects)
    assert result is not None
    assert result.residuals_are_white
    assert result.is_accepted(THRESHOLD)
    numbers = re.fullmatch(pattern.replace("#", r"(-?[0-9.e-]+)"), formula_text(result.robot, result.formulas))
    assert numbers is not None, formula_text(result.robot, result.formulas)
    return [float(number) for number in numbers.groups()]


@pytest.mark.validate
def test_a_force_across_the_motion() -> None:
    across, along = found_in({"unlisted_sideways": {"constant": 30.0}}, r"force_x = #\*vy; force_y = #\*vx")
    assert (across, along) == pytest.approx((-30.0, 30.0), rel=0.01)


@pytest.mark.validate
def test_a_rope_that_stiffens() -> None:
    (factor,) = found_in({"unlisted_stiffening": {"quadratic": 100.0}}, r"tension = #\*tension\*\*2")
    assert factor == pytest.approx(100.0 / AXIAL, rel=0.01)


@pytest.mark.validate
def test_a_tank_that_fills() -> None:
    assert found_in({"unlisted_filling": {"rate": 1.0}}, r"mass = #\*time") == pytest.approx([1.0], rel=0.01)


@pytest.mark.validate
def test_a_machine_that_shakes() -> None:
    shaken = {"unlisted_shaker": {"amplitude": [10.0, 0.0, 10.0], "frequency": 1.7}}
    first, pace, second, same = found_in(shaken, r"force_x = #\*sin\(#\*time\); force_z = #\*sin\(#\*time\)")
    assert (first, second) == pytest.approx((10.0, 10.0), rel=0.05)
    assert pace == same == pytest.approx(10.6814, rel=1e-4)


@pytest.mark.validate
def test_a_formula_of_the_robot_file_stays() -> None:
    half = replace(ROBOT, formulas=(Formula("force_x", "-30*vy"),))
    result = discovered({"unlisted_sideways": {"constant": 30.0}}, robot=half)
    assert result is not None
    assert result.residuals_are_white
    assert [formula.target for formula in result.formulas] == ["force_y"]
    assert result.robot.formulas == (*half.formulas, *result.formulas)


@pytest.mark.validate
def test_nothing_is_found_where_nothing_is_hidden() -> None:
    results = [discovered({}, seed) for seed in (5, 6)]
    assert not any(each is not None and each.is_accepted(THRESHOLD) for each in results)


@pytest.mark.validate
@pytest.mark.parametrize(
    "effects",
    [
        {"modulus": {"modulus": 0.95 * ROBOT.cables[0].modulus}},
        {"drum": {"eccentricity": 0.004, "phase": 0.8, "radius": 0.137}},
    ],
    ids=["modulus", "drum"],
)
def test_a_known_effect_by_another_name_earns_no_place(effects: dict[str, Any]) -> None:
    result = discovered(effects)
    assert result is not None
    assert result.log_likelihood_gain > THRESHOLD
    assert not result.is_accepted(THRESHOLD)


@pytest.mark.validate
def test_what_swings_has_no_formula() -> None:
    result = discovered({"unlisted_swing": {"mass": 20.0, "length": 2.0}})
    assert result is None or not result.residuals_are_white
