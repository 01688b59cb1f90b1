"""What the linearised plant says, shown by the FMUs in co-simulation: free decay, and a swept sine."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import curve_fit

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.linear import LinearPlant, linearise
from tautwire.robot.schema import Robot
from tests.support.robots import NAMES, example

Array = NDArray[np.float64]


@pytest.fixture(scope="module", params=NAMES)
def robot(request: pytest.FixtureRequest) -> Robot:
    return example(request.param)


@pytest.fixture(scope="module")
def fmus(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(robot, tmp_path_factory.mktemp(robot.name), native=True)


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_free_decay_has_frequency_and_damping_of_the_mode(robot: Robot, fmus: RobotFmus, mode: int) -> None:
    plant = linearise(robot)
    omega, ratio = 2 * pi * plant.modes.frequencies[mode], plant.modes.damping_ratios[mode]
    time, swing = decay(robot, fmus, plant, mode)

    def model(t: Array, size: float, phase: float, rest: float, w: float, z: float) -> Array:
        return size * np.exp(-z * w * t) * np.cos(w * sqrt(1.0 - z * z) * t + phase) + rest

    phase = -np.angle(np.sum((swing - swing[-1]) * np.exp(-1j * omega * time)).conj())
    guess = (np.abs(swing).max(), phase, swing[-1], omega, ratio)
    (_, _, _, found_omega, found_ratio), _ = curve_fit(model, time, swing, guess)
    assert found_omega == pytest.approx(omega, rel=1e-5)
    assert found_ratio == pytest.approx(ratio, rel=1e-3)


def decay(robot: Robot, fmus: RobotFmus, plant: LinearPlant, mode: int) -> tuple[Array, Array]:
    """Swing along one mode, in mm, once the winches stand still after one period of shaking along it."""
    frequency, shape = plant.modes.frequencies[mode], plant.modes.shapes[:, mode]
    periods = min(12.0, 3.0 / (2 * pi * plant.modes.damping_ratios[mode]))
    count = 40
    time = np.arange(0.0, round((periods + 1) * count) + 1) / (count * frequency)
    spans = np.array(robot.anchors) - robot.platform.start
    along = (spans / np.linalg.norm(spans, axis=1, keepdims=True)) @ shape
    shaking = np.where(np.arange(len(time)) <= count, np.sin(2 * pi * frequency * time), 0.0)
    speeds = 2e-4 * 2 * pi * frequency * shaking[:, None] * along
    motion = cosimulate(fmus, time, speeds)
    swing = 1e3 * (motion.position - robot.platform.start) @ shape
    return time[count:] - time[count], swing[count:]


@pytest.mark.validate
def test_a_swept_sine_has_gain_and_phase_of_the_transfer_functions(robot: Robot, fmus: RobotFmus) -> None:
    plant = linearise(robot)
    low, high = 0.6 * plant.modes.frequencies[0], 1.4 * plant.modes.frequencies[-1]
    time, speed = swept(plant, low, high)
    speeds = np.zeros((len(time), robot.cable_count))
    speeds[:, 0] = speed
    shown = outputs(cosimulate(fmus, time, speeds, step=1.0))
    # Ten frequencies about all modes; the sweep begins and ends at rest, so its spectra tell the gains.
    frequencies = np.linspace(0.85 * plant.modes.frequencies[0], 1.15 * plant.modes.frequencies[-1], 10)
    result = spectra(time, shown - shown[0], frequencies)
    given = spectra(time, speed[:, None], frequencies) * np.sinc(frequencies * (time[1] - time[0]))[:, None] ** 2
    system = plant.system
    expected = system[system.output_labels, "winch_speed_1"](2j * pi * frequencies).reshape(
        len(system.output_labels), -1
    )
    likeness = result.T / given.T / expected
    assert np.abs(np.abs(likeness) - 1.0).max() < 0.002
    assert np.degrees(np.abs(np.angle(likeness))).max() < 0.2


def swept(plant: LinearPlant, low: float, high: float) -> tuple[Array, Array]:
    """Times, and the speed of a winch whose rope sweeps 0.1 mm from ``low`` to ``high`` (Hz), then rests for long."""
    step = 1.0 / (20.0 * plant.modes.frequencies[-1])
    duration = 40.0 / plant.modes.frequencies[0]
    slowest = np.min(2 * pi * plant.modes.damping_ratios * plant.modes.frequencies)
    time = step * np.arange(round((duration + 8.0 / slowest) / step))
    swing = np.sin(2 * pi * (low * time + 0.5 * (high - low) / duration * time**2))
    edge = np.clip(np.minimum(time, duration - time) / (0.15 * duration), 0.0, 1.0)
    return time, np.gradient(1e-4 * np.sin(0.5 * pi * edge) ** 2 * swing, time)


def outputs(motion: CosimulationResult) -> Array:
    return np.hstack([motion.position, motion.velocity, motion.tension, motion.length])


def spectra(time: Array, values: Array, frequencies: Array) -> NDArray[np.complex128]:
    """Fourier integrals of what is zero at both ends, (number of frequencies, number of columns)."""
    waves = np.exp(-2j * pi * np.outer(frequencies, time))
    result: NDArray[np.complex128] = (time[1] - time[0]) * waves @ values
    return result
