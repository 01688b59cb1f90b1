"""The robust controller: its margins over the whole range, in the co-simulation too, and no wind-up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import (
    ClosedLoopOptions,
    ControlAim,
    Knot,
    MarginError,
    Range,
    RobustAim,
    RobustController,
    cosimulate_closed_loop,
    design_controller,
    design_robust,
    margins_over,
    rigid_reference,
    sample_times,
    schedule_robust,
)
from tautwire.control.path_controller import controller_data
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot
from tautwire.robot.trajectory import Line
from tautwire_fmu.laws import sampled_control as law
from tests.support.robots import example

Array = NDArray[np.float64]


PATH = Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 4.0)
STAY = Line((28.86, 0.0, 5.0), (28.86, 0.0, 5.0), 1.0)


@pytest.fixture(scope="module")
def three() -> Robot:
    return example("three")


@pytest.fixture(scope="module")
def design(three: Robot) -> RobustController:
    return design_robust(three)


@pytest.fixture(scope="module")
def three_example_fmus(three: Robot, tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(three, tmp_path_factory.mktemp("robust"), native=True)


def errors(position: Array, time: Array) -> Array:
    return np.asarray(np.linalg.norm(position - PATH.position(time), axis=1))


def test_over_a_narrow_range_the_loop_is_faster_and_keeps_its_margin(three: Robot) -> None:
    narrow = Range((115e9, 120e9), (1.0, 1.05))
    design = design_robust(three, parameter_range=narrow)
    margins = margins_over(three, design.knots(), np.array([three.platform.start]), narrow, points=2)
    assert min(margins.winch_disk, margins.sensor_disk) > 2.0 / 3.0
    # Over the whole range it is 0.48.
    assert design.bandwidth > 0.7


@pytest.mark.validate
def test_margins_hold_on_a_finer_grid_than_that_of_the_design(three: Robot, design: RobustController) -> None:
    start = np.array([three.platform.start])
    margins = margins_over(three, design.knots(), start, Range(), points=4)
    assert min(margins.winch_disk, margins.sensor_disk) > 2.0 / 3.0
    assert margins.gain_margin > 2.0 and margins.phase_margin > 37.0 and margins.spectral_radius < 0.99
    lqg = margins_over(three, design_controller(three).knots(), start, Range(), points=2)
    assert lqg.winch_disk < 0.8 * margins.winch_disk


@pytest.mark.validate
def test_loop_is_the_fastest_of_those_that_keep_the_margin(three: Robot, design: RobustController) -> None:
    slower = design_robust(three, robust=RobustAim(margin=0.85))
    assert slower.bandwidth < design.bandwidth
    assert min(slower.margins.winch_disk, slower.margins.sensor_disk) >= 0.85


@pytest.mark.validate
def test_scheduled_loop_keeps_the_margin_along_the_path_and_between_its_places(three: Robot) -> None:
    rise = Line((28.86, 0.0, 5.0), (24.0, 3.0, 14.0), 10.0)
    scheduled = schedule_robust(three, rise, points=3)
    plan = law.plan_from_resource(
        controller_data(three, scheduled, rigid_reference(three, rise, sample_times(0.01, 10.0)))
    )
    for sample in (250, 500):
        gains = law.gains_at(plan, sample)
        through = np.hstack([np.zeros((3, 6)), gains.D])
        knot = Knot(0.0, control.ss(gains.A, gains.B, gains.C, through, 0.01), np.array(gains.M))
        margins = margins_over(three, (knot,), rise.position(np.array([0.01 * sample])), Range(), points=2)
        assert margins.min_disk > 0.97 * 2.0 / 3.0


@pytest.mark.validate
def test_margin_that_no_loop_has_is_refused(three: Robot) -> None:
    narrow = Range((118e9, 119e9), (0.99, 1.01))
    with pytest.raises(MarginError, match=r"a disk margin of 1\.9 cannot be reached") as caught:
        design_robust(three, parameter_range=narrow, robust=RobustAim(margin=1.9))
    assert 0.5 < caught.value.achieved < 1.9


@pytest.mark.validate
def test_path_is_held_at_the_corners_of_the_range(three: Robot, design: RobustController, tmp_path: Path) -> None:
    for modulus, payload, robot in Range().robots(three, 2):
        fmus = build_fmus(robot, tmp_path / f"{modulus:g}-{payload:g}", native=True)
        motion = cosimulate_closed_loop(fmus, three, design, PATH, 12.0, ClosedLoopOptions(seed=1))
        away = errors(motion.position, motion.time)
        assert motion.tension.min() > 1000.0
        assert np.sqrt(np.mean(away[-100:] ** 2)) < 1e-3


@pytest.mark.validate
def test_force_is_answered_without_a_lasting_error(
    three: Robot, design: RobustController, three_example_fmus: RobotFmus
) -> None:
    push = np.zeros((1201, 3))
    push[100:, 2] = -0.05 * 300.0 * 9.81
    motion = cosimulate_closed_loop(
        three_example_fmus, three, design, STAY, 12.0, ClosedLoopOptions(external_force=push)
    )
    away = np.linalg.norm(motion.position - three.platform.start, axis=1)
    assert 5e-3 < away.max() < 2e-2
    assert away[-1] < 1e-4


@pytest.mark.validate
def test_nothing_winds_up_at_the_limit_of_speed(
    three: Robot, design: RobustController, three_example_fmus: RobotFmus
) -> None:
    span = np.array([0.64, 0.7, 1.2])

    def overshoot(controller: RobustController) -> float:
        motion = cosimulate_closed_loop(three_example_fmus, three, controller, PATH, 9.0)
        assert errors(motion.position, motion.time).max() > 0.3
        return float(np.max((motion.position - three.platform.start) @ span / (span @ span))) - 1.0

    limited = replace(design, aim=ControlAim(speed_limit=0.3))
    assert overshoot(limited) < 0.03
    assert overshoot(replace(limited, tracking=np.zeros_like(design.tracking))) > 0.15
