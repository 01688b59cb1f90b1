"""Scheduled gains: one design everywhere is that design, several follow each other without a bump."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import (
    ClosedLoopOptions,
    ControlAim,
    Design,
    PathController,
    ScheduledController,
    cosimulate_closed_loop,
    design_controller,
    sample_times,
    schedule_controller,
)
from tautwire.errors import InputError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.trajectory import PAPER_HELIX, Line
from tests.support.robots import example

Array = NDArray[np.float64]

RISE = Line((28.86, 0.0, 5.0), (28.86, 0.0, 25.0), 10.0)


@pytest.fixture(scope="module")
def three() -> Robot:
    return example("three")


@pytest.fixture(scope="module")
def three_example_fmus(three: Robot, tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(three, tmp_path_factory.mktemp("schedule"), native=True)


def asked(robot: Robot, design: Design, samples: int) -> Array:
    """Accelerations beyond the path's while the platform is seen 1 mm beside it all along."""
    times = sample_times(0.01, 0.01 * samples)
    source = PathController(robot, design, RISE, times)
    expected, count = np.array(source.plan.expected), robot.cable_count
    results = []
    for k in range(samples):
        shown = np.concatenate([expected[k, :3] + 1e-3, np.zeros(3), expected[k, 3:]])
        results.append(source.interval(k, times[k], 0.01, shown)[0][1 : 2 * count : 2])
    speeds = np.array(source.plan.speeds)
    return np.array(results) - np.diff(speeds[: samples + 1], axis=0) / 0.01


def test_one_design_at_all_places_is_that_design(three: Robot) -> None:
    single = design_controller(three)
    scheduled = ScheduledController((0.0, 1.0, 2.5), (single, single, single))
    assert asked(three, scheduled, 300) == pytest.approx(asked(three, single, 300), rel=1e-9, abs=1e-12)


def test_designs_are_made_for_the_places_of_the_path(three: Robot) -> None:
    aim = ControlAim(position=2e-3)
    scheduled = schedule_controller(three, RISE, aim, points=3)
    assert scheduled.times == (0.0, 5.0, 10.0) and scheduled.aim == aim and scheduled.cable_count == 3
    assert [plant.position.tolist() for plant in scheduled.plants] == RISE.position(np.array([0.0, 5.0, 10.0])).tolist()
    there = design_controller(three, aim, (28.86, 0.0, 15.0)).regulator
    middle, last = (knot.regulator for knot in scheduled.knots()[1:])
    assert np.array_equal(middle.A, there.A) and np.array_equal(middle.C, there.C)
    assert np.max(np.abs(last.C - middle.C)) > 0.02 * np.max(np.abs(middle.C))


def test_designs_of_different_states_are_not_interpolated(three: Robot) -> None:
    relaxing = three.with_effect(EffectSetting("relaxation", {"modulus": 2e10, "time": 1.0}, (1, 2, 3)))
    designs = (design_controller(three), design_controller(relaxing))
    with pytest.raises(InputError, match="reach other states or coordinates at 1 s than at 0 s"):
        ScheduledController((0.0, 1.0), designs)


def test_one_design_takes_over_from_the_next_without_a_bump(three: Robot) -> None:
    soft, stiff = design_controller(three, ControlAim(position=4e-3)), design_controller(three)
    smooth = ScheduledController((0.0, 2.0, 4.0), (soft, stiff, soft))
    abrupt = ScheduledController((0.0, 1.999, 2.0, 4.0), (soft, soft, stiff, stiff))
    bumps = []
    for design in (smooth, abrupt):
        steps = np.abs(np.diff(asked(three, design, 260), axis=0))
        bumps.append(np.max(steps[195:210]))
    assert bumps[0] < 0.05 * bumps[1]


@pytest.mark.validate
def test_scheduled_controller_holds_the_paper_helix_under_noise(three: Robot, three_example_fmus: RobotFmus) -> None:
    design = schedule_controller(three, PAPER_HELIX)
    motion = cosimulate_closed_loop(three_example_fmus, three, design, PAPER_HELIX, 52.0, ClosedLoopOptions(seed=1))
    away = np.linalg.norm(motion.position - PAPER_HELIX.position(motion.time), axis=1)
    assert np.sqrt(np.mean(away**2)) < 5e-4
    assert motion.tension.min() > 1000.0
