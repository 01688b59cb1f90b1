"""The coupled system with and without rollback: convergence order, energy residual, checkpoints."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.cosimulation import (
    AdaptiveStep,
    CouplingSolver,
    Experiment,
    FixedStep,
    MemoryRecorder,
    PiecewiseLinearInput,
    StepSizeError,
    Wiring,
    build_coupling_graph,
    simulate,
)
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports, robot_connections, winch_input_ports
from tautwire.fmus.packaging import RobotFmus
from tests.rig import RampProgram
from tests.rig import simulate as rig_simulate
from tests.support.rig_robots import CORNERS, RAMP, rig_of
from tests.support.robots import paper_robot

RAMPS = PiecewiseLinearInput(CORNERS, np.clip(RAMP * CORNERS[:, None], -1.0, 1.0))


def end_error(coupling: CouplingSolver, step: float) -> float:
    recorder = MemoryRecorder(len(CORNERS), 18)
    simulate(coupling, Experiment(RAMPS, CORNERS, FixedStep(step)), recorded_ports(3), recorder)
    exact = rig_simulate(rig_of(paper_robot()), None, RampProgram(RAMP, 1.0), CORNERS, rtol=1e-12, atol=1e-13)
    return float(np.linalg.norm(recorder.rows[-1, :3] - exact.position[-1]))


def test_without_rollback_each_step_is_one_sweep(three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_rollback=False))
        assert end_error(coupling, 0.01) < 1e-4
        assert coupling.statistics.iterations == 0
        assert coupling.statistics.sweeps == coupling.statistics.steps


@pytest.mark.validate
def test_the_statistics_show_the_energy_of_a_coupling_without_iteration(three_fmus: RobotFmus) -> None:
    residual_shares = []
    for supports_rollback in (True, False):
        with instantiate_robot(three_fmus) as graph:
            coupling = CouplingSolver(replace(graph, supports_rollback=supports_rollback))
            end_error(coupling, 0.05)
            residual_shares.append(coupling.statistics.energy_residual_share)
    assert residual_shares[1] > 100.0 * residual_shares[0]


def test_restoring_a_checkpoint_reproduces_the_step(three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(graph)
        simulate(coupling, Experiment(RAMPS, CORNERS[:2], FixedStep(0.02)), recorded_ports(3), MemoryRecorder(2, 18))
        external_inputs = RAMPS.interval(1, CORNERS[1], 0.02, np.zeros(0))
        checkpoint = coupling.save()
        ends = []
        for _ in range(2):
            coupling.step(CORNERS[1], 0.02, *external_inputs)
            platform = coupling.graph.components["platform"]
            block = platform.block(["position.x", "velocity.z"])
            platform.read(block)
            ends.append(block.values.copy())
            coupling.restore(checkpoint)
        coupling.release(checkpoint)
    assert ends[0] == pytest.approx(ends[1], rel=1e-13)


def test_a_tolerance_that_no_step_meets_is_an_error(three_fmus: RobotFmus) -> None:
    experiment = Experiment(RAMPS, CORNERS, AdaptiveStep(1e-22, 7.0))
    with instantiate_robot(three_fmus) as graph, pytest.raises(StepSizeError, match="larger --tolerance"):
        coupling = CouplingSolver(graph, experiment.step_size_control.solver_options)
        simulate(coupling, experiment, recorded_ports(3), MemoryRecorder(4, 18))


@pytest.mark.validate
def test_midpoint_values_give_order_six(three_fmus: RobotFmus) -> None:
    errors = []
    for step in (0.1, 0.05):
        with instantiate_robot(three_fmus) as graph:
            assert graph.convergence_order == 6
            errors.append(end_error(CouplingSolver(graph), step))
    assert errors[0] < 2e-7
    assert 25.0 < errors[0] / errors[1] < 100.0


@pytest.mark.validate
def test_without_midpoint_values_the_order_is_four(three_fmus: RobotFmus) -> None:
    errors = []
    for step in (0.05, 0.025):
        with instantiate_robot(three_fmus) as graph:
            wiring = Wiring(connections=tuple(robot_connections(3)), external_inputs=tuple(winch_input_ports(3)))
            plain = build_coupling_graph(graph.components, wiring)
            assert plain.convergence_order == 4
            errors.append(end_error(CouplingSolver(plain), step))
    assert errors[0] < 2e-5
    assert 10.0 < errors[0] / errors[1] < 30.0


def position_mismatch(coupling: CouplingSolver) -> float:
    """Difference between the platform position at the input of a cable and at the output of the platform, in m."""
    platform, cable = coupling.graph.components["platform"], coupling.graph.components["cable_1"]
    output, cable_input = (c.block(["position.x", "position.y", "position.z"]) for c in (platform, cable))
    platform.read(output)
    cable.read(cable_input)
    return float(np.abs(output.values - cable_input.values).max())


def test_recorded_outputs_follow_from_the_recorded_position(three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(graph)
        end_error(coupling, 0.1)
        assert position_mismatch(coupling) == 0.0


@pytest.mark.parametrize("supports_rollback", [True, False])
def test_converged_inputs_are_updated_when_outputs_are_read(supports_rollback: bool, three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_rollback=supports_rollback))
        simulate(coupling, Experiment(RAMPS, CORNERS[:2], FixedStep(0.1)), recorded_ports(3), MemoryRecorder(2, 18))
        checkpoint = coupling.attempt_step(CORNERS[1], 0.1, *RAMPS.interval(1, CORNERS[1], 0.1, np.zeros(0)))
        assert (position_mismatch(coupling) > 0.0) is supports_rollback
        coupling.update_inputs()
        assert position_mismatch(coupling) == 0.0
        if checkpoint is not None:
            coupling.release(checkpoint)
