"""Margins: what python-control says of the loops, and what the loops do when they are changed by that much."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import (
    Controller,
    Feedforward,
    Knot,
    Margins,
    Range,
    design_controller,
    margins_of,
    margins_over,
    ramp_plant,
    robot_with,
    speed_controller,
)
from tautwire.control.stability_margins import FREQUENCY_COUNT, MIN_RELATIVE_FREQUENCY
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.robots import example

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def caroca() -> Robot:
    return example("caroca")


@pytest.fixture(scope="module")
def design(caroca: Robot) -> Controller:
    return design_controller(caroca)


def radius(plant: Any, feedback: Any, factors: Array) -> float:
    """Of the slowest pole with the winches' gains multiplied."""
    return float(np.max(np.abs(control.feedback(plant * np.diag(factors), feedback, 1).poles())))


def test_speed_controller_closes_the_same_loop_as_the_regulator(design: Controller) -> None:
    loop = control.feedback(ramp_plant(design.linear, 0.01), speed_controller(design.regulator), 1)
    expected = control.feedback(design.plant, design.regulator, 1)
    assert np.sort(np.abs(loop.poles())) == pytest.approx(np.sort(np.abs(expected.poles())), abs=1e-6)


def test_margins_agree_with_the_sensitivity(design: Controller) -> None:
    margins = margins_of(design.linear, design.knots()[0])
    plant, feedback = ramp_plant(design.linear, 0.01), speed_controller(design.regulator)
    omega = np.geomspace(1.0, 0.999 * np.pi / 0.01, 3000)
    z = np.exp(1j * omega * 0.01)
    loop = -np.einsum("aik,akj->aij", at(plant, z), at(feedback, z))
    sensitivity = np.linalg.inv(np.eye(6) + loop)
    one = 1.0 / np.max(np.abs(np.diagonal(sensitivity, axis1=1, axis2=2) - 0.5))
    assert margins.sensor_disk == pytest.approx(one, rel=5e-3)
    # Of all winches at once: between the norm, which knows of no structure, and that of the worst one alone.
    inner = np.linalg.inv(np.eye(3) - np.einsum("aik,akj->aij", at(feedback, z), at(plant, z)))
    whole = 1.0 / np.max(np.linalg.norm(inner - 0.5 * np.eye(3), ord=2, axis=(1, 2)))
    single = 1.0 / np.max(np.abs(np.diagonal(inner, axis1=1, axis2=2) - 0.5))
    assert whole * 0.99 < margins.winch_disk < single * 1.01


def test_margins_of_all_winches_at_once_are_those_of_python_control(design: Controller) -> None:
    plant, feedback = ramp_plant(design.linear, 0.01), speed_controller(design.regulator)
    nyquist = np.pi / 0.01
    omega = np.geomspace(MIN_RELATIVE_FREQUENCY * nyquist, 0.999 * nyquist, FREQUENCY_COUNT)
    expected = control.disk_margins(-feedback * plant, omega)[0]
    assert margins_of(design.linear, design.knots()[0]).winch_disk == pytest.approx(expected, rel=1e-6)


def at(system: Any, z: Array) -> Array:
    """The transfer matrix at points of the plane, (len(z), outputs, inputs)."""
    return np.moveaxis(np.array(system(z)), -1, 0)


def test_a_winch_may_gain_or_lose_what_the_gain_margin_says(design: Controller) -> None:
    margins = margins_of(design.linear, design.knots()[0])
    plant, feedback = ramp_plant(design.linear, 0.01), speed_controller(design.regulator)

    def worst(factor: float) -> float:
        trials = [np.where(np.arange(3) == k, f, 1.0) for k in range(3) for f in (factor, 1.0 / factor)]
        return max(radius(plant, feedback, trial) for trial in trials)

    assert worst(0.99 * margins.gain_margin) < 1.0 < worst(1.01 * margins.gain_margin)


def test_all_winches_may_change_at_once_by_what_the_disk_margin_says(design: Controller) -> None:
    margins = margins_of(design.linear, design.knots()[0])
    plant, feedback = ramp_plant(design.linear, 0.01), speed_controller(design.regulator)
    assert margins.disk_gain == pytest.approx((2.0 + margins.winch_disk) / (2.0 - margins.winch_disk))
    random = np.random.default_rng(4)
    for _ in range(50):
        factors = margins.disk_gain ** random.uniform(-1.0, 1.0, 3)
        assert radius(plant, feedback, factors) < 1.0
    assert margins.disk_gain < margins.gain_margin and margins.disk_phase < margins.phase_margin


def test_range_is_that_of_the_papers_rope_or_as_wide_about_another_one(caroca: Robot) -> None:
    assert Range.of(caroca) == Range((102e9, 135e9), (0.8, 1.2))
    softer = caroca.with_effect(EffectSetting("modulus", {"modulus": 60e9}, caroca.cable_numbers))
    assert Range.of(softer) == Range.of(robot_with(caroca, 60e9, 1.0))
    assert robot_with(softer, 1e11, 1.0) == robot_with(caroca, 1e11, 1.0)
    soft = Range.of(robot_with(caroca, 60e9, 1.0))
    assert soft.payloads == (0.8, 1.2)
    assert soft.moduli == pytest.approx((60e9 * 102 / 118.5, 60e9 * 135 / 118.5))


@pytest.mark.validate
def test_each_sample_of_delay_costs_margin_until_the_loop_breaks(design: Controller) -> None:
    margins = [margins_of(design.linear, late(design.knots()[0], samples)) for samples in range(6)]
    for before, after in pairwise(margins[:3]):
        assert (
            after.phase_margin < before.phase_margin - 2.0
            and after.winch_disk < before.winch_disk
            and after.gain_margin < before.gain_margin
        )
    assert margins[2].spectral_radius < 1.0 < margins[5].spectral_radius
    assert margins[5].winch_disk == margins[5].sensor_disk == margins[5].gain_margin == margins[5].phase_margin == 0.0


def late(knot: Knot, samples: int) -> Knot:
    """The same controller, some samples later."""
    count = knot.regulator.noutputs
    sensors = knot.regulator.ninputs - count
    delay = control.ss(np.zeros((sensors, sensors)), np.eye(sensors), np.eye(sensors), 0.0, knot.regulator.dt)
    seen = control.append(delay, control.ss([], [], [], np.eye(count), knot.regulator.dt))
    regulator = knot.regulator
    for _ in range(samples):
        regulator = regulator * seen
    return Knot(knot.time, regulator, np.zeros((regulator.nstates, count)))


def test_no_loop_has_no_margin_to_lose(design: Controller) -> None:
    margins = margins_of(design.linear, Feedforward(3).knots()[0])
    assert margins.winch_disk == margins.sensor_disk == margins.gain_margin == margins.phase_margin == np.inf
    assert Margins(0.5, 2.0, 1.0, 1.0, 1.0).disk_gain == np.inf


@pytest.mark.validate
def test_range_takes_the_worst_of_its_robots(caroca: Robot, design: Controller) -> None:
    uncertain, start = Range((102e9, 135e9), (0.8, 1.2)), np.array([caroca.platform.start])
    worst = margins_over(caroca, design.knots(), start, uncertain, 2)
    corners = [(E, share, robot) for E, share, robot in uncertain.robots(caroca, 2)]
    assert [(E, share) for E, share, _ in corners] == [(102e9, 0.8), (102e9, 1.2), (135e9, 0.8), (135e9, 1.2)]
    assert all(robot == robot_with(caroca, E, share) for E, share, robot in corners)
    each = [margins_over(robot, design.knots(), start) for *_, robot in corners]
    assert worst.winch_disk == min(m.winch_disk for m in each)
    assert worst.spectral_radius == max(m.spectral_radius for m in each)
    assert uncertain.middle(caroca) == robot_with(caroca, 118.5e9, 1.0)
