"""The platform FMU alone: what it shows under forces, and the force that is missing to a path."""

from dataclasses import replace
from functools import cache
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation.localisation.cable_simulation import CableSimulation
from tautwire.estimation.localisation.force_balance import force_balance, measured_forces, simulate_platform
from tautwire.estimation.localisation.path_smoothing import SmoothedPath
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.robots import example

Array = NDArray[np.float64]

TIME = np.arange(0.0, 30.0, 0.02)
SIGMAS = (3e-4, 3e-4, 3e-4, 2.0, 2.0, 2.0)
MASS = 300.0


@cache
def path() -> SmoothedPath:
    """A turn about the start of the three-cable robot."""
    start, omega = np.array(example("three").platform.start), np.array([0.5, 0.7, 0.9])
    angle = omega * TIME[:, None]
    return SmoothedPath(
        TIME,
        start + np.sin(angle),
        omega * np.cos(angle),
        -(omega**2) * np.sin(angle),
        np.zeros((len(TIME), 3, 3, 3)),
        np.ones(3),
        np.ones(3, dtype=bool),
    )


def needed(extra: Array | float = 0.0) -> Array:
    """Forces (N, 3, 3) of three cables that keep the path, or fall short of it by ``extra`` (N, 3)."""
    total = MASS * (path().acceleration + np.array([0.0, 0.0, 9.81])) - extra
    lines = np.array(example("three").anchors) - path().position[:, None, :]
    directions = lines / np.linalg.norm(lines, axis=2)[:, :, None]
    tensions = np.linalg.solve(directions.swapaxes(1, 2), total[:, :, None])
    forces: Array = tensions * directions
    return forces


def shown(robot: Robot, forces: Array) -> Array:
    with TemporaryDirectory() as folder:
        return simulate_platform(build_fmus(robot, FilePath(folder)).platform, path(), forces, MASS)


def noisy(seed: int) -> Array:
    noise: Array = path().position + np.random.default_rng(seed).normal(0.0, SIGMAS[0], (len(TIME), 3))
    return noise


@pytest.mark.validate
def test_under_the_forces_of_a_path_it_shows_its_acceleration() -> None:
    assert shown(example("three"), needed()) == pytest.approx(path().acceleration, abs=1e-9)


@pytest.mark.validate
def test_what_depends_on_the_motion_is_felt_along_the_path() -> None:
    braked = example("three").with_effect(EffectSetting("drag", {"drag_area": 30.0}))
    speed = np.linalg.norm(path().velocity, axis=1)[:, None]
    drag = -0.5 * 1.225 * 30.0 * speed * path().velocity
    result = MASS * (shown(braked, needed()) - path().acceleration)
    assert np.max(np.abs(result - drag)[100:]) < 0.02 * np.max(np.abs(drag))


@pytest.mark.validate
def test_a_missing_tension_leaves_a_gap_and_no_more() -> None:
    forces = needed()
    forces[400:410, 1] = np.nan
    result = shown(example("three"), forces)
    assert np.all(np.isnan(result[400:410]))
    rest = np.delete(np.arange(len(TIME)), range(400, 410))
    assert result[rest] == pytest.approx(path().acceleration[rest], abs=1e-9)
    force = force_balance(path(), noisy(1), result, forces, MASS, SIGMAS).force
    assert np.all(np.isnan(force[405]))
    assert np.mean(np.isfinite(force)) == pytest.approx(1.0 - 10 / len(TIME))
    assert np.nanmax(np.abs(force)) < 5.0


def test_noise_of_positions_and_load_cells_leaves_what_is_expected() -> None:
    random = np.random.default_rng(2)
    directions = needed() / np.linalg.norm(needed(), axis=2)[:, :, None]
    squares, expected = np.zeros(3), np.zeros(3)
    for seed in range(12):
        cells = random.normal(0.0, SIGMAS[3], (len(TIME), 3, 1)) * directions
        accelerations = path().acceleration + np.sum(cells, axis=1) / MASS
        balance = force_balance(path(), noisy(seed), accelerations, needed(), MASS, SIGMAS)
        squares += np.mean(balance.force**2, axis=0)
        expected += np.mean(balance.expected_deviation**2, axis=0)
    assert squares / expected == pytest.approx(np.ones(3), abs=0.3)


def test_a_missing_force_is_found_where_it_acts() -> None:
    extra = np.column_stack([5.0 * np.sin(1.7 * TIME), np.zeros_like(TIME), np.full_like(TIME, 20.0)])
    accelerations = path().acceleration - extra / MASS
    force = force_balance(path(), noisy(3), accelerations, needed(), MASS, SIGMAS).force
    assert np.max(np.abs(force - extra)[150:-150]) < 2.0
    assert np.std((force - extra)[150:-150]) < 0.5


def test_forces_follow_measured_tensions_along_the_fmus_direction() -> None:
    force = np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 0.0]])
    run = CableSimulation(np.array([5.0, 0.0]), np.ones(2), force, np.zeros((2, 7)))
    result = measured_forces([run], np.array([[10.0], [2.0]]), np.array([[0.0, 0.0, 9.0]]), np.zeros((2, 3)))
    assert result[:, 0] == pytest.approx(np.array([[6.0, 0.0, 8.0], [0.0, 0.0, 2.0]]))


def test_an_axis_that_was_not_measured_is_left_out() -> None:
    flat = replace(path(), measured=np.array([True, False, True]))
    balance = force_balance(flat, noisy(4), path().acceleration, needed(), MASS, SIGMAS)
    assert np.isfinite(balance.cutoff).tolist() == [True, False, True]
    assert np.all(np.isnan(balance.force[:, 1]))
