"""Coupling with FMUs that can do less than ours."""

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
    kept = MemoryRecorder(len(CORNERS), 18)
    simulate(coupling, Experiment(RAMPS, CORNERS, FixedStep(step)), recorded_ports(3), kept)
    exact = rig_simulate(rig_of(paper_robot()), None, RampProgram(RAMP, 1.0), CORNERS, rtol=1e-12, atol=1e-13)
    return float(np.linalg.norm(kept.rows[-1, :3] - exact.position[-1]))


def test_without_saved_states_it_goes_on_with_one_pass(three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_rollback=False))
        assert end_error(coupling, 0.01) < 1e-4
        assert coupling.statistics.iterations == 0
        assert coupling.statistics.sweeps == coupling.statistics.steps


def test_the_statistics_show_the_energy_of_a_coupling_without_iteration(three_fmus: RobotFmus) -> None:
    shares = []
    for supports_rollback in (True, False):
        with instantiate_robot(three_fmus) as graph:
            coupling = CouplingSolver(replace(graph, supports_rollback=supports_rollback))
            end_error(coupling, 0.05)
            shares.append(coupling.statistics.energy_residual_share)
    assert shares[1] > 100.0 * shares[0]


def test_a_checkpoint_takes_everything_back(three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(graph)
        simulate(coupling, Experiment(RAMPS, CORNERS[:2], FixedStep(0.02)), recorded_ports(3), MemoryRecorder(2, 18))
        drives = RAMPS.interval(1, CORNERS[1], 0.02, np.zeros(0))
        checkpoint = coupling.save()
        ends = []
        for _ in range(2):
            coupling.step(CORNERS[1], 0.02, *drives)
            platform = coupling.graph.components["platform"]
            block = platform.block(["position.x", "velocity.z"])
            platform.read(block)
            ends.append(block.values.copy())
            coupling.restore(checkpoint)
        coupling.release(checkpoint)
    assert ends[0] == pytest.approx(ends[1], rel=1e-13)


def test_a_tolerance_that_no_step_meets_is_said(three_fmus: RobotFmus) -> None:
    experiment = Experiment(RAMPS, CORNERS, AdaptiveStep(1e-22, 7.0))
    with instantiate_robot(three_fmus) as graph, pytest.raises(StepSizeError, match="larger --tolerance"):
        coupling = CouplingSolver(graph, experiment.step_size_control.solver_options)
        simulate(coupling, experiment, recorded_ports(3), MemoryRecorder(4, 18))


def test_what_holds_in_the_middle_of_a_step_gives_the_sixth_order(three_fmus: RobotFmus) -> None:
    errors = []
    for step in (0.1, 0.05):
        with instantiate_robot(three_fmus) as graph:
            assert graph.convergence_order == 6
            errors.append(end_error(CouplingSolver(graph), step))
    assert errors[0] < 2e-7
    assert 25.0 < errors[0] / errors[1] < 100.0


def test_without_the_middle_the_order_is_four(three_fmus: RobotFmus) -> None:
    errors = []
    for step in (0.05, 0.025):
        with instantiate_robot(three_fmus) as graph:
            wiring = Wiring(connections=tuple(robot_connections(3)), external_inputs=tuple(winch_input_ports(3)))
            plain = build_coupling_graph(graph.components, wiring)
            assert plain.convergence_order == 4
            errors.append(end_error(CouplingSolver(plain), step))
    assert errors[0] < 2e-5
    assert 10.0 < errors[0] / errors[1] < 30.0


def parted(coupling: CouplingSolver) -> float:
    """By how much what a cable was given of the platform's place differs from what the platform shows."""
    platform, cable = coupling.graph.components["platform"], coupling.graph.components["cable_1"]
    shown, given = (c.block(["position.x", "position.y", "position.z"]) for c in (platform, cable))
    platform.read(shown)
    cable.read(given)
    return float(np.abs(shown.values - given.values).max())


def test_what_is_recorded_follows_from_the_place_that_is_recorded(three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(graph)
        end_error(coupling, 0.1)
        assert parted(coupling) == 0.0


@pytest.mark.parametrize("supports_rollback", [True, False])
def test_inputs_that_agree_wait_until_outputs_are_read(supports_rollback: bool, three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_rollback=supports_rollback))
        simulate(coupling, Experiment(RAMPS, CORNERS[:2], FixedStep(0.1)), recorded_ports(3), MemoryRecorder(2, 18))
        checkpoint = coupling.attempt_step(CORNERS[1], 0.1, *RAMPS.interval(1, CORNERS[1], 0.1, np.zeros(0)))
        assert (parted(coupling) > 0.0) is supports_rollback
        coupling.update_inputs()
        assert parted(coupling) == 0.0
        if checkpoint is not None:
            coupling.release(checkpoint)
