"""Effects and formulas in a whole robot as one native FMU, beside its components coupled by the master."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire.robot.schema import Formula, Robot
from tests.support.effect_cases import CASES, DELAYED, PAIRS, RIGID_CASES, SEVERAL, UNLISTED_CASES, Case
from tests.support.effects import with_effects
from tests.support.rigid_robots import suspended_robot
from tests.support.robots import LIMITED, example, gentle_speeds, with_winch
from tests.support.whole_robots import both_ways

COMPLETE = with_winch(with_effects(example("three"), *SEVERAL, DELAYED), LIMITED)
EVERYTHING = with_winch(with_effects(example("three"), *CASES), LIMITED)
# Of the values' sizes, at least one; with strands that stick and slip the master's steps err more.
SAME, SAME_WITH_HYSTERESIS = 1e-9, 2e-8


def test_several_effects_on_winches_are_those_of_the_components(tmp_path: Path) -> None:
    time, speed = gentle_speeds(example("three"), 0.5, 0.02)
    assert both_ways(COMPLETE, tmp_path, time, speed, (0.02, 0.002)) < 1e-8


@pytest.mark.validate
def test_all_effects_together_on_winches_are_those_of_the_components(tmp_path: Path) -> None:
    time, speed = gentle_speeds(example("three"), 0.5, 0.02)
    assert both_ways(EVERYTHING, tmp_path, time, speed, (0.02, 0.002)) < 1e-8


@pytest.mark.validate
@pytest.mark.parametrize(
    "cases", [*((case,) for case in (*CASES, *UNLISTED_CASES)), *PAIRS], ids=lambda cases: "+".join(map(str, cases))
)
def test_each_effect_is_that_of_the_components(cases: tuple[Case, ...], tmp_path: Path) -> None:
    time, speed = gentle_speeds(example("three"), 1.0, 0.02)
    has_hysteresis = any(case.name == "hysteresis" for case in cases)
    difference = both_ways(with_effects(example("three"), *cases), tmp_path, time, speed, (0.02, 0.002))
    assert difference < (SAME_WITH_HYSTERESIS if has_hysteresis else SAME)


@pytest.mark.validate
@pytest.mark.parametrize("case", RIGID_CASES, ids=str)
def test_each_effect_on_a_platform_that_turns_is_that_of_the_components(case: Case, tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.8, 41)
    speed = np.outer(np.sin(8.0 * time) ** 2, [0.05, -0.02, 0.0, 0.01])
    assert both_ways(with_effects(suspended_robot(4), case), tmp_path, time, speed, (0.02, 0.002)) < 1e-7


FORMULAS = (
    Formula("tension", "20 * tanh(5 * travel) + 3 * sin(4 * time)", (2,)),
    Formula("force_x", "30 * sin(5 * time) - 4 * vx"),
    Formula("mass", "10 * sin(time)"),
)


@pytest.mark.validate
@pytest.mark.parametrize("base", [example("three"), suspended_robot(4)], ids=["point", "turning"])
def test_formulas_are_those_of_the_components(base: Robot, tmp_path: Path) -> None:
    time = np.linspace(0.0, 0.6, 31)
    speed = np.outer(np.sin(8.0 * time) ** 2, [0.05, -0.02, 0.0, 0.01][: base.cable_count])
    assert both_ways(replace(base, formulas=FORMULAS), tmp_path, time, speed, (0.02, 0.002)) < 1e-8
