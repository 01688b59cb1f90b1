"""What the books of a run tell a user."""

from dataclasses import replace

import pytest

from tautwire.cosimulation import CouplingSolver, SolverOptions
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.run_statistics import RunStatistics
from tautwire.fmus.packaging import RobotFmus
from tests.cosimulation.test_coupling_solver import end_error


def test_a_large_energy_residual_is_a_warning() -> None:
    assert RunStatistics(steps=10, energy_residual=-0.009, energy_exchanged=1.0).warnings() == ()
    (warning,) = RunStatistics(steps=10, energy_residual=-0.011, energy_exchanged=1.0).warnings()
    assert "-0.011 J" in warning and "1.1 %" in warning


def test_a_few_steps_at_corners_may_reach_the_iteration_limit() -> None:
    assert RunStatistics(steps=10, unconverged_steps=1).warnings() == ()
    (warning,) = RunStatistics(steps=10, unconverged_steps=2).warnings()
    assert "in 2 of 10 steps" in warning and "--step" in warning


@pytest.mark.parametrize(("max_iterations", "converges"), [(8, True), (1, False)])
def test_steps_that_do_not_converge_are_counted(max_iterations: int, converges: bool, three_fmus: RobotFmus) -> None:
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(graph, SolverOptions(max_iterations=max_iterations))
        end_error(coupling, 0.14)
        assert (coupling.statistics.unconverged_steps == 0) is converges
        assert (coupling.statistics.warnings() == ()) is converges


def test_steps_without_rollback_are_not_counted_as_unconverged(three_fmus: RobotFmus) -> None:
    """They are a fallback of their own."""
    with instantiate_robot(three_fmus) as graph:
        coupling = CouplingSolver(replace(graph, supports_rollback=False))
        end_error(coupling, 0.05)
        assert coupling.statistics.unconverged_steps == 0
