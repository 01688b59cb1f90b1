"""Steps that are too long for what couples the FMUs, and FMUs that discard a step."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tautwire.cosimulation import (
    ComponentError,
    CouplingSolver,
    Experiment,
    FixedStep,
    MemoryRecorder,
    PiecewiseLinearInput,
    simulate,
)
from tautwire.cosimulation.coupling_state import Checkpoint
from tautwire.cosimulation.macro_step import MAX_HALVINGS, step_with_rejection
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
    return build_fmus(read_robot(folder / "robot.toml"), folder), load_robot(folder / "rig.toml")


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
        kept = MemoryRecorder(len(time), len(recorded_ports(4)))
        simulate(
            coupling, Experiment(PiecewiseLinearInput(time, speed), time, FixedStep(step)), recorded_ports(4), kept
        )
    exact = rig_simulate(rig, PULLEY, SampledProgram(time, speed), time).position
    return float(np.max(np.abs(kept.rows[:, :3] - exact))), coupling


@pytest.mark.validate
@pytest.mark.parametrize("step", [0.08, 0.16, 0.32])
def test_steps_whose_iteration_diverges_are_halved(planar: tuple[RobotFmus, RigRobot], step: float) -> None:
    error, coupling = errors(planar, step)
    assert error < 2e-3
    assert coupling.statistics.steps > 1.2 * (12.0 / step)


@pytest.mark.validate
def test_steps_that_converge_stay_whole(planar: tuple[RobotFmus, RigRobot]) -> None:
    error, coupling = errors(planar, 0.01)
    assert error < 1e-7
    assert coupling.statistics.steps < 1.1 * 1200


class Given:
    """A solver of which only steps up to ``longest`` (s) do not diverge; an FMU fails with ``status`` in the others."""

    def __init__(self, longest: float, status: str | None = None) -> None:
        self.longest, self.status = longest, status
        self.state = SimpleNamespace(diverged=False)
        self.tried: list[float] = []
        self.released = 0

    def attempt_step(self, time: float, step: float, start: np.ndarray, end: np.ndarray) -> Checkpoint | None:
        self.tried.append(step)
        self.state.diverged = step > self.longest
        if self.state.diverged and self.status is not None:
            raise ComponentError("cable_1", "fmi2DoStep", self.status, time, {}, ())
        return Checkpoint((), None)  # type: ignore[arg-type]

    def restore(self, checkpoint: Checkpoint) -> None:
        pass

    def release(self, checkpoint: Checkpoint) -> None:
        self.released += 1


def held(given: Given) -> float:
    return step_with_rejection(given, 0.0, 0.16, lambda time, step: (np.zeros(0), np.zeros(0)))[0]  # type: ignore[arg-type]


@pytest.mark.parametrize("status", [None, "discard", "error"])
def test_a_step_is_halved_until_it_holds(status: str | None) -> None:
    given = Given(0.05, status)
    assert held(given) == pytest.approx(0.04)
    assert given.tried == pytest.approx([0.16, 0.08, 0.04])
    assert given.released == (2 if status is None else 0)


def test_the_shortest_step_is_accepted_even_if_it_diverges() -> None:
    given = Given(0.0)
    assert held(given) == pytest.approx(0.16 / 2**MAX_HALVINGS)
    assert given.state.diverged


@pytest.mark.parametrize(("status", "tries"), [("discard", MAX_HALVINGS + 1), ("fatal", 1)])
def test_an_fmu_that_fails_however_short_the_step_is_told(status: str, tries: int) -> None:
    given = Given(0.0, status)
    with pytest.raises(ComponentError, match=status):
        held(given)
    assert len(given.tried) == tries
