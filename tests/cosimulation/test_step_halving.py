"""Macro steps that are too long for the coupling of a light platform on stiff cables."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.cosimulation import (
    CouplingSolver,
    Experiment,
    FixedStep,
    MemoryRecorder,
    PiecewiseLinearInput,
    simulate,
)
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.robot_file_reader import read_robot
from tests.rig import Robot as RigRobot
from tests.rig import SampledProgram, load_robot
from tests.rig import simulate as rig_simulate
from tests.support.planar import VERTICAL, program_of, robot_text

PULLEY = {"pulley": {"radius": 0.03}}


@pytest.fixture(scope="module")
def planar(tmp_path_factory: pytest.TempPathFactory) -> tuple[RobotFmus, RigRobot]:
    """Four light cables on five kilograms, which swing at 12 Hz, and bounce where they are shaken."""
    folder = tmp_path_factory.mktemp("planar")
    (folder / "rig.toml").write_text(robot_text(VERTICAL))
    (folder / "robot.toml").write_text(robot_text(VERTICAL) + "[effect.pulley]\nradius = 0.03\n")
    return build_fmus(read_robot(folder / "robot.toml"), folder, native=True), load_robot(folder / "rig.toml")


def shaken(rig: RigRobot, every: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and winch speeds, each ``every`` seconds."""
    program = program_of(rig, VERTICAL, 1, 12.0)
    time = np.arange(round(12.0 / every)) * every
    return time, np.array([program.speed(float(at)) for at in time])


def errors(planar: tuple[RobotFmus, RigRobot], step: float) -> tuple[float, CouplingSolver]:
    """How far the platform is from the rig's at most, m."""
    fmus, rig = planar
    time, speed = shaken(rig, step)
    with instantiate_robot(fmus) as graph:
        coupling = CouplingSolver(graph)
        recorder = MemoryRecorder(len(time), len(recorded_ports(4)))
        simulate(
            coupling, Experiment(PiecewiseLinearInput(time, speed), time, FixedStep(step)), recorded_ports(4), recorder
        )
    exact = rig_simulate(rig, PULLEY, SampledProgram(time, speed), time).position
    return float(np.max(np.abs(recorder.rows[:, :3] - exact))), coupling


@pytest.mark.validate
def test_steps_whose_iteration_diverges_are_halved(planar: tuple[RobotFmus, RigRobot]) -> None:
    error, coupling = errors(planar, 0.32)
    assert error < 2e-3
    assert coupling.statistics.steps > 1.2 * (12.0 / 0.32)


@pytest.mark.validate
def test_steps_that_converge_are_not_halved(planar: tuple[RobotFmus, RigRobot]) -> None:
    error, coupling = errors(planar, 0.01)
    assert error < 1e-7
    assert coupling.statistics.steps < 1.1 * 1200
