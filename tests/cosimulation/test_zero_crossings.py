"""Steps over cables that go slack and tight again."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.cosimulation import (
    CouplingSolver,
    Experiment,
    FixedStep,
    MemoryRecorder,
    PiecewiseLinearInput,
    RunStatistics,
    simulate,
)
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Platform
from tests.rig import SampledProgram
from tests.rig import simulate as rig_simulate
from tests.support.rig_robots import rig_of
from tests.support.robots import paper_robot

ROBOT = replace(paper_robot(damping=2e8), platform=Platform(300.0, (28.86, 0.0, 5.0)))
TIME = np.array([0.0, 0.05, 0.5, 0.55, 1.0, 1.5])
SPEED = np.zeros((6, 3))
SPEED[1:3, 2] = -1.5


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return rig_simulate(rig_of(ROBOT), None, SampledProgram(TIME, SPEED), TIME, rtol=1e-12, atol=1e-13).position


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(ROBOT, tmp_path_factory.mktemp("slack"), native=True)


def run(fmus: RobotFmus, step: float, locate_events: bool = True) -> tuple[np.ndarray, RunStatistics]:
    experiment = Experiment(PiecewiseLinearInput(TIME, SPEED), TIME, FixedStep(step))
    with instantiate_robot(fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_variable_step=locate_events))
        recorder = MemoryRecorder(len(TIME), len(recorded_ports(3)))
        simulate(coupling, experiment, recorded_ports(3), recorder)
        return recorder.rows[:, :3].copy(), coupling.statistics


def test_steps_keep_their_order_over_a_cable_that_goes_slack(fmus: RobotFmus, exact: np.ndarray) -> None:
    coarse, fine = (float(np.max(np.abs(run(fmus, step)[0] - exact))) for step in (0.02, 0.01))
    assert fine < 2e-7
    assert coarse > 4.0 * fine


def test_without_event_location_a_slack_cable_costs_the_order(fmus: RobotFmus, exact: np.ndarray) -> None:
    position, statistics = run(fmus, 0.01, locate_events=False)
    assert np.max(np.abs(position - exact)) > 1e-5
    assert statistics.steps == 150


def test_each_event_costs_few_steps(fmus: RobotFmus) -> None:
    assert run(fmus, 0.01)[1].steps < 150 + 6 * 4


def test_the_cable_pulls_less_than_nothing_only_while_its_tension_is_zero(fmus: RobotFmus) -> None:
    with instantiate_robot(fmus) as graph:
        cable = graph.components["cable_3"]
        block = cable.block(["pull", "tension"])
        pulls = []
        for height in (0.0, 0.5, 1.0):
            place = cable.block(["input_time", "position.x", "position.y", "position.z"])
            start = np.array(ROBOT.platform.start)
            place.values[:] = [height, *(start + height * (np.array(ROBOT.anchors[2]) - start) * 0.01)]
            cable.write(place)
            cable.read(block)
            pulls.append(tuple(block.values))
    assert pulls[0][0] == pytest.approx(pulls[0][1])
    for pull, tension in pulls[1:]:
        assert pull < 0.0
        assert tension == 0.0
