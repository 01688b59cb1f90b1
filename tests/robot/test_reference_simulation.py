"""Every effect in the model in memory against the rig's own equations."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.robot.reference_simulation import ReferenceRun, integrate
from tests.support.effect_cases import CASES, PAIRS, Case
from tests.support.effects import by_the_rig, with_effects
from tests.support.robots import example, gentle_speeds

SLOW_EIGHT = pytest.param("eight", marks=pytest.mark.validate)


def differ(run: ReferenceRun, tension: np.ndarray, position: np.ndarray) -> tuple[float, float]:
    return float(np.max(np.abs(run.position - position))), float(np.max(np.abs(run.tension - tension)))


@pytest.mark.parametrize("name", ["three", SLOW_EIGHT])
@pytest.mark.parametrize("case", CASES, ids=str)
def test_an_effect_is_that_of_the_rig(case: Case, name: str) -> None:
    robot = example(name)
    time, speed = gentle_speeds(robot, 1.0, 0.02)
    run = integrate(with_effects(robot, case), time, speed)
    position_error, tension_error = differ(run, *by_the_rig(robot, time, speed, case))
    assert position_error < 1e-9
    assert tension_error < 1e-4
    plain = integrate(robot, time, speed)
    position, tension = differ(run, plain.tension, plain.position)
    assert position > 100.0 * position_error + 1e-8 or tension > 100.0 * tension_error + 1e-2


@pytest.mark.validate(only=["eight", "radius+friction"])
@pytest.mark.parametrize("name", ["three", SLOW_EIGHT])
@pytest.mark.parametrize("cases", PAIRS, ids=lambda cases: "+".join(map(str, cases)))
def test_effects_together_are_those_of_the_rig(cases: tuple[Case, ...], name: str) -> None:
    robot = example(name)
    time, speed = gentle_speeds(robot, 1.0, 0.02)
    run = integrate(with_effects(robot, *cases), time, speed)
    position_error, tension_error = differ(run, *by_the_rig(robot, time, speed, *cases))
    assert position_error < 1e-9
    assert tension_error < 1e-4


def test_a_lagging_sensor_shows_the_start_at_first() -> None:
    robot = example("three")
    case = next(case for case in CASES if "tension_delay" in case.law)
    time, speed = gentle_speeds(robot, 0.1, 0.005)
    run, plain = integrate(with_effects(robot, case), time, speed), integrate(robot, time, speed)
    assert np.array_equal(run.tension[time < 0.023], np.broadcast_to(plain.tension[0], (5, 3)))
    assert np.array_equal(run.position, plain.position)
