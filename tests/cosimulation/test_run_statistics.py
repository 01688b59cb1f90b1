"""What the books of a run tell a user."""

from dataclasses import replace

import pytest

from tautwire.cosimulation import CouplingSolver, SolverOptions
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.run_statistics import RunStatistics
from tautwire.fmus.packaging import RobotFmus
from tests.cosimulation.test_coupling_solver import end_error


def test_energy_that_the_coupling_makes_is_told() -> None:
    assert RunStatistics(steps=10, energy_residual=-0.009, energy_exchanged=1.0).warnings() == ()
    (told,) = RunStatistics(steps=10, energy_residual=-0.011, energy_exchanged=1.0).warnings()
    assert "-0.011 J" in told and "1.1 %" in told


def test_a_few_steps_at_corners_may_reach_the_iteration_limit() -> None:
    assert RunStatistics(steps=10, unconverged_steps=1).warnings() == ()
    (told,) = RunStatistics(steps=10, unconverged_steps=2).warnings()
    assert "in 2 of 10 steps" in told and "--step" in told


@pytest.mark.parametrize(("redos", "settles"), [(8, True), (1, False)])
def test_steps_that_do_not_converge_are_counted(redos: int, settles: bool, three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(graph, SolverOptions(max_iterations=redos))
        end_error(coupling, 0.14)
        assert (coupling.statistics.unconverged_steps == 0) is settles
        assert (coupling.statistics.warnings() == ()) is settles


def test_steps_without_rollback_are_told_elsewhere(three_fmus: RobotFmus) -> None:
    """They are a fallback of their own."""
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_rollback=False))
        end_error(coupling, 0.05)
        assert coupling.statistics.unconverged_steps == 0
