"""Quasi-Newton acceleration of a fixed-point iteration, with the history of earlier steps."""

import numpy as np
import pytest

from tautwire.cosimulation.quasi_newton import QuasiNewton, QuasiNewtonHistory

SLOWLY = np.array([[0.6, 0.2, 0.0], [0.1, 0.5, -0.3], [0.0, 0.2, 0.4]])
OFFSET = np.array([1.0, -2.0, 0.5])
SOLUTION = np.linalg.solve(np.eye(3) - SLOWLY, OFFSET)


def sweep(inputs: np.ndarray, matrix: np.ndarray = SLOWLY) -> np.ndarray:
    return matrix @ inputs + OFFSET


def error_after(iterations: int, solver: QuasiNewton, inputs: np.ndarray, matrix: np.ndarray = SLOWLY) -> float:
    solver.begin_step()
    solver.update(inputs, sweep(inputs, matrix))
    for _ in range(iterations):
        inputs = solver.next_input()
        solver.update(inputs, sweep(inputs, matrix))
    solution = np.linalg.solve(np.eye(3) - matrix, OFFSET)
    return float(np.max(np.abs(sweep(inputs, matrix) - solution)))


def test_a_linear_coupling_of_three_is_solved_in_four_iterations() -> None:
    assert error_after(4, QuasiNewton(3), np.zeros(3)) < 1e-12


def test_the_history_of_one_step_serves_the_next() -> None:
    solver = QuasiNewton(3)
    error_after(4, solver, np.zeros(3))
    assert error_after(1, solver, np.array([5.0, -1.0, 2.0])) < 1e-10
    solver.reset()
    assert error_after(1, solver, np.array([5.0, -1.0, 2.0])) > 1e-3


def test_the_history_serves_a_coupling_that_has_changed_a_little() -> None:
    solver = QuasiNewton(3)
    error_after(4, solver, np.zeros(3))
    start = np.array([5.0, -1.0, 2.0])
    assert error_after(1, solver, start, 1.01 * SLOWLY) < 0.03 * error_after(1, QuasiNewton(3), start, 1.01 * SLOWLY)


def test_a_fixed_point_iteration_that_diverges_is_solved_too() -> None:
    assert error_after(4, QuasiNewton(3), np.zeros(3), -3.0 * SLOWLY) < 1e-12


def test_the_first_iteration_is_a_fixed_point_step() -> None:
    solver = QuasiNewton(3)
    solver.begin_step()
    solver.update(np.zeros(3), sweep(np.zeros(3)))
    assert solver.next_input() == pytest.approx(sweep(np.zeros(3)))


def test_an_iteration_that_repeats_its_inputs_adds_nothing() -> None:
    solver = QuasiNewton(3)
    solver.begin_step()
    for _ in range(2):
        solver.update(SOLUTION, sweep(SOLUTION))
    assert solver.next_input() == pytest.approx(SOLUTION)


def test_the_error_is_estimated_without_another_sweep() -> None:
    solver = QuasiNewton(3)
    error_after(4, solver, np.zeros(3))
    inputs = np.array([5.0, -1.0, 2.0])
    solver.begin_step()
    solver.update(inputs, sweep(inputs))
    true = float(np.max(np.abs(sweep(inputs) - SOLUTION)))
    assert true < solver.error_estimate() < 3.0 * true


def test_without_history_the_whole_residual_is_the_error_estimate() -> None:
    solver = QuasiNewton(3)
    solver.begin_step()
    solver.update(np.zeros(3), sweep(np.zeros(3)))
    assert solver.error_estimate() == pytest.approx(np.max(np.abs(OFFSET)))


def test_secant_pairs_are_kept_by_step_size() -> None:
    lessons = QuasiNewtonHistory(3)
    long, short = lessons.for_step_size(0.1), lessons.for_step_size(0.05)
    assert long is not short
    assert lessons.for_step_size(0.104) is long
    assert lessons.for_step_size(0.052) is short
    lessons.reset()
    assert lessons.for_step_size(0.1) is not long
