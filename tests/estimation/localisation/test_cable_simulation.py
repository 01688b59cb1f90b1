"""A cable FMU alone: along the path of the whole robot it shows what it showed there."""

from functools import cache
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.estimation.localisation.cable_simulation import (
    CableSimulation,
    drift_variance,
    exit_shift,
    simulate_cable,
    tension_variance,
)
from tautwire.estimation.localisation.path_smoothing import SmoothedPath
from tautwire.fmus.packaging import build_fmus
from tests.support.robots import example, gentle_speeds

RATE = 100.0


@cache
def runs() -> tuple[CosimulationResult, SmoothedPath, CableSimulation]:
    """The three-cable robot co-simulated, its path, and its second cable alone along it."""
    robot = example("three")
    time, speeds = gentle_speeds(robot, 6.0, 1.0 / RATE)
    with TemporaryDirectory() as folder:
        fmus = build_fmus(robot, FilePath(folder))
        motion = cosimulate(fmus, time, speeds)
        acceleration = np.gradient(motion.velocity, time, axis=0)
        covariance = np.zeros((len(time), 3, 3, 3))
        path = SmoothedPath(
            time, motion.position, motion.velocity, acceleration, covariance, np.ones(3), np.ones(3, dtype=bool)
        )
        return motion, path, simulate_cable("cable_2", fmus.cables[1], path, speeds[:, 1])


@pytest.mark.validate
def test_alone_it_shows_the_tension_and_force_of_the_whole() -> None:
    motion, path, run = runs()
    assert np.max(np.abs(run.tension - motion.tension[:, 1])) < 0.02
    assert np.ptp(run.tension) > 20.0
    assert np.allclose(run.length, motion.length[:, 1], atol=1e-9)
    line = np.array(example("three").anchors[1]) - path.position
    direction = line / np.linalg.norm(line, axis=1)[:, None]
    assert np.allclose(run.force, run.tension[:, None] * direction, atol=1e-6)


def test_slopes_are_those_of_the_law() -> None:
    _, path, run = runs()
    cable = example("three").cables[1]
    line = np.array(cable.anchor) - path.position
    direction = line / run.length[:, None]
    stiffness = cable.modulus * cable.area / run.length
    viscosity = cable.damping * cable.area / run.length
    assert run.stiffness == pytest.approx(stiffness, rel=2e-3)
    assert np.allclose(
        run.sensitivities[:, 3:6], -viscosity[:, None] * direction, rtol=2e-3, atol=1e-3 * np.max(viscosity)
    )
    assert run.sensitivities[:, 6] == pytest.approx(viscosity, rel=2e-3)


def test_noise_of_the_path_counts_by_the_stiffness() -> None:
    _, path, run = runs()
    known = np.zeros((len(path.time), 3, 3, 3))
    known[:, :, 0, 0] = 1e-4**2
    loose = SmoothedPath(path.time, path.position, path.velocity, path.acceleration, known, path.cutoff, path.measured)
    expected = 2.0**2 + (1e-4 * run.stiffness) ** 2
    assert tension_variance(run, loose, 2.0, 0.0) == pytest.approx(expected, rel=1e-6)


def test_noise_of_winch_speeds_drifts_as_many_tries_show() -> None:
    _, path, run = runs()
    sigma, random = 2e-3, np.random.default_rng(1)
    noise = random.normal(0.0, sigma, (4000, len(path.time)))
    wound = np.zeros_like(noise)
    wound[:, 1:] = np.cumsum(0.5 * (noise[:, 1:] + noise[:, :-1]) / RATE, axis=1)
    felt = run.stiffness * wound
    variance, of_mean = drift_variance(run, path.time, sigma)
    assert np.mean(felt[:, -1] ** 2) == pytest.approx(variance[-1], rel=0.1)
    assert np.mean(np.mean(felt, axis=1) ** 2) == pytest.approx(of_mean, rel=0.1)


def test_a_shift_of_the_exit_point_is_read_off_the_residual() -> None:
    _, _, run = runs()
    shift = np.array([0.02, -0.05, 0.03])
    direction = -run.sensitivities[:, :3] / run.stiffness[:, None]
    residual = run.stiffness * ((direction - direction[0]) @ shift)
    residual -= np.mean(residual)
    found, left = exit_shift(run, residual, 0.01 * float(np.std(residual)), 10.0)
    assert np.std(left) < 0.01 * np.std(residual)
    assert (direction - direction[0]) @ found == pytest.approx((direction - direction[0]) @ shift, abs=1e-4)


def test_a_shift_that_would_be_too_large_explains_nothing() -> None:
    _, _, run = runs()
    residual = run.sensitivities[:, :3] @ np.array([0.02, -0.05, 0.03])
    residual -= np.mean(residual)
    _, left = exit_shift(run, residual, 0.1 * float(np.std(residual)), 1e-4)
    assert np.std(left) > 0.9 * np.std(residual)
