"""Input shaping: no swing where it promises none, by the textbook's formula and by the motion of a mode."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import (
    ClosedLoopOptions,
    Feedforward,
    Shaper,
    cosimulate_closed_loop,
    rigid_reference,
    sample_times,
    shape_along,
    shaped,
    shaper,
    shaper_for_modes,
)
from tautwire.control.input_shaping import ShapedTrajectory, ShaperKind
from tautwire.errors import InputError
from tautwire.fmus.packaging import RobotFmus
from tautwire.robot.trajectory import Line, Trajectory
from tests.support.robots import paper_robot
from tests.support.winch_ramp import WinchRamp

Array = NDArray[np.float64]

PATH = Line((28.86, 0.0, 5.0), (28.0, 0.5, 7.0), 3.0)


def energy_after(impulses: Shaper, frequency: float, damping_ratio: float) -> float:
    """Energy of a mode just after the last impulse, by python-control's own simulation."""
    omega = 2.0 * np.pi * frequency
    mode = control.ss([[0, 1], [-(omega**2), -2 * damping_ratio * omega]], [[0], [1]], np.eye(2), 0)
    state = np.zeros(2)
    order = np.argsort(impulses.delays)
    for k, place in enumerate(order):
        state = state + np.array([0.0, impulses.amplitudes[place]])
        if k + 1 < len(order):
            gap = impulses.delays[order[k + 1]] - impulses.delays[place]
            times = np.array([0.0, max(gap, 1e-12)])
            state = control.initial_response(mode, times, state).states[:, -1]
    return float((omega * state[0]) ** 2 + 2 * damping_ratio * omega * state[0] * state[1] + state[1] ** 2)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.014, 0.2])
@pytest.mark.parametrize("kind", ["ZV", "ZVD"])
def test_no_swing_is_left_at_the_frequency_that_was_meant(kind: ShaperKind, damping_ratio: float) -> None:
    impulses = shaper(1.2, damping_ratio, kind)
    assert np.sum(impulses.amplitudes) == pytest.approx(1.0)
    assert impulses.residual_vibration(1.2, damping_ratio) == pytest.approx(0.0, abs=1e-12)
    assert energy_after(impulses, 1.2, damping_ratio) == pytest.approx(0.0, abs=1e-20)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.05])
@pytest.mark.parametrize("kind", ["ZV", "ZVD", "EI"])
def test_residual_is_the_swing_of_a_mode_after_the_last_impulse(kind: ShaperKind, damping_ratio: float) -> None:
    impulses = shaper(1.2, damping_ratio, kind)
    for frequency in (0.9, 1.2, 1.5):
        expected = np.sqrt(energy_after(impulses, frequency, damping_ratio))
        assert impulses.residual_vibration(frequency, damping_ratio) == pytest.approx(expected, abs=1e-9)


def test_a_mode_that_does_not_swing_gets_no_impulses() -> None:
    with pytest.raises(InputError, match=r"damping_ratio: is 1\.2, with which no mode swings"):
        shaper(1.2, 1.2)
    with pytest.raises(InputError, match="'foo' is not a known shaper"):
        shaper_for_modes(np.zeros(0), np.zeros(0), cast(ShaperKind, "foo"))
    robot = replace(paper_robot(), cables=tuple(replace(each, damping=1e13) for each in paper_robot().cables))
    path = shape_along(robot, PATH, points=3)
    assert isinstance(path, ShapedTrajectory)
    assert path.amplitudes.shape == (3, 1)
    assert path.duration == pytest.approx(PATH.duration)


def test_shapers_are_as_robust_as_the_textbook_says() -> None:
    near = np.array([1.0 - 1e-3, 1.0 + 1e-3])
    slope = np.pi / 2.0 * 1e-3
    assert shaper(1.0, kind="ZV").residual_vibration(near) == pytest.approx(slope, rel=1e-3)
    assert shaper(1.0, kind="ZVD").residual_vibration(near) == pytest.approx(slope**2, rel=1e-2)
    assert shaper(1.0, kind="EI").residual_vibration(1.0) == pytest.approx(0.05)
    # Bands with less than 5 per cent left: 6, 29 and 40 per cent of the frequency.
    around = np.linspace(0.6, 1.4, 8001)
    bands = [np.ptp(around[shaper(1.0, kind=kind).residual_vibration(around) < 0.0501]) for kind in ("ZV", "ZVD", "EI")]
    assert bands == pytest.approx([0.064, 0.287, 0.399], abs=2e-3)


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="'ZVDD' is not a known shaper; choose among ZV, ZVD, EI"):
        shaper(1.0, 0.0, cast(ShaperKind, "ZVDD"))


def test_shaper_for_three_modes_has_no_swing_in_any() -> None:
    frequencies, ratios = np.array([1.1, 1.2, 1.7]), np.array([0.01, 0.02, 0.05])
    impulses = shaper_for_modes(frequencies, ratios)
    assert len(impulses.amplitudes) == 8
    assert np.max(impulses.delays) == pytest.approx(np.sum(0.5 / (frequencies * np.sqrt(1.0 - ratios**2))))
    for frequency, ratio in zip(frequencies, ratios, strict=True):
        assert impulses.residual_vibration(frequency, ratio) == pytest.approx(0.0, abs=1e-12)


def test_motion_of_a_shaped_path_is_consistent_and_a_line_stays_one() -> None:
    path = shape_along(paper_robot(damping=4e8), PATH, "ZVD", points=4)
    assert np.ptp(path.delays[:, -1]) > 1e-3
    times = np.linspace(-0.5, path.duration + 1.0, 60001)
    position, velocity, acceleration = path.position(times), path.velocity(times), path.acceleration(times)
    step = times[1] - times[0]
    assert np.gradient(position, step, axis=0)[2:-2] == pytest.approx(velocity[2:-2], abs=1e-5)
    # Where a spline ends its curvature may jump.
    differences = np.abs(np.gradient(velocity, step, axis=0) - acceleration)[2:-2].max(axis=1)
    assert np.quantile(differences, 0.999) < 1e-3
    assert position[0] == pytest.approx(PATH.start) and position[-1] == pytest.approx(PATH.end)
    span = np.array(PATH.end) - np.array(PATH.start)
    assert np.cross(position - np.array(PATH.start), span) == pytest.approx(0.0, abs=1e-9)


def test_constant_shaper_gives_the_sum_of_late_paths() -> None:
    impulses = Shaper(np.array([0.6, 0.4]), np.array([0.0, 0.5]))
    path, times = shaped(PATH, impulses), np.linspace(0.0, 4.0, 41)
    for name in ("position", "velocity", "acceleration"):
        early, late = getattr(PATH, name)(times), getattr(PATH, name)(times - 0.5)
        assert getattr(path, name)(times) == pytest.approx(0.6 * early + 0.4 * late)
    assert path.duration == 3.5


def swing(times: Array, away: Array, begin: float) -> float:
    """Largest swing about a smooth motion after a time, in m."""
    late = times >= begin
    scaled = np.interp(times[late], [begin, times[-1]], [-1.0, 1.0])
    smooth = np.vander(scaled, 5)
    left = away[late] - smooth @ np.linalg.lstsq(smooth, away[late], rcond=None)[0]
    return float(np.max(np.linalg.norm(left, axis=1)))


@pytest.mark.validate
def test_swing_after_the_ramp_is_cut_by_far_more_than_twenty(three_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = paper_robot()
    ramp: Trajectory = WinchRamp(robot, 10.0)
    feedforward, times = Feedforward(3), sample_times(0.01, 9.0)
    left = []
    for path in (ramp, shape_along(robot, ramp)):
        reference = rigid_reference(robot, path, times)
        motion = cosimulate_closed_loop(
            three_fmus, robot, feedforward, path, 9.0, ClosedLoopOptions(reference=reference)
        )
        left.append(swing(times, motion.position - path.position(times), 6.0))
        assert motion.tension.min() > 900.0
    assert left[0] > 5e-3
    assert left[1] < left[0] / 200.0
