"""The next pass of a step, found from earlier ones."""

import numpy as np
import pytest

from tautwire.cosimulation.quasi_newton import QuasiNewton, QuasiNewtonHistory

SLOWLY = np.array([[0.6, 0.2, 0.0], [0.1, 0.5, -0.3], [0.0, 0.2, 0.4]])
OFFSET = np.array([1.0, -2.0, 0.5])
SOLUTION = np.linalg.solve(np.eye(3) - SLOWLY, OFFSET)


def passed(given: np.ndarray, matrix: np.ndarray = SLOWLY) -> np.ndarray:
    return matrix @ given + OFFSET


def error_after(redos: int, secants: QuasiNewton, given: np.ndarray, matrix: np.ndarray = SLOWLY) -> float:
    secants.begin_step()
    secants.update(given, passed(given, matrix))
    for _ in range(redos):
        given = secants.next_input()
        secants.update(given, passed(given, matrix))
    solution = np.linalg.solve(np.eye(3) - matrix, OFFSET)
    return float(np.max(np.abs(passed(given, matrix) - solution)))


def test_a_linear_coupling_of_three_is_solved_in_four_iterations() -> None:
    assert error_after(4, QuasiNewton(3), np.zeros(3)) < 1e-12


def test_what_one_step_taught_serves_the_next() -> None:
    secants = QuasiNewton(3)
    error_after(4, secants, np.zeros(3))
    assert error_after(1, secants, np.array([5.0, -1.0, 2.0])) < 1e-10
    secants.reset()
    assert error_after(1, secants, np.array([5.0, -1.0, 2.0])) > 1e-3


def test_a_coupling_that_has_changed_a_little_is_still_known() -> None:
    secants = QuasiNewton(3)
    error_after(4, secants, np.zeros(3))
    start = np.array([5.0, -1.0, 2.0])
    assert error_after(1, secants, start, 1.01 * SLOWLY) < 0.03 * error_after(1, QuasiNewton(3), start, 1.01 * SLOWLY)


def test_passes_that_lead_away_are_solved_too() -> None:
    assert error_after(4, QuasiNewton(3), np.zeros(3), -3.0 * SLOWLY) < 1e-12


def test_the_first_iteration_is_a_fixed_point_step() -> None:
    secants = QuasiNewton(3)
    secants.begin_step()
    secants.update(np.zeros(3), passed(np.zeros(3)))
    assert secants.next_input() == pytest.approx(passed(np.zeros(3)))


def test_a_pass_that_repeats_itself_teaches_nothing() -> None:
    secants = QuasiNewton(3)
    secants.begin_step()
    for _ in range(2):
        secants.update(SOLUTION, passed(SOLUTION))
    assert secants.next_input() == pytest.approx(SOLUTION)


def test_the_error_is_told_without_another_pass() -> None:
    secants = QuasiNewton(3)
    error_after(4, secants, np.zeros(3))
    given = np.array([5.0, -1.0, 2.0])
    secants.begin_step()
    secants.update(given, passed(given))
    true = float(np.max(np.abs(passed(given) - SOLUTION)))
    assert true < secants.error_estimate() < 3.0 * true


def test_what_is_not_learnt_yet_is_taken_for_an_error() -> None:
    secants = QuasiNewton(3)
    secants.begin_step()
    secants.update(np.zeros(3), passed(np.zeros(3)))
    assert secants.error_estimate() == pytest.approx(np.max(np.abs(OFFSET)))


def test_secant_pairs_are_kept_by_step_size() -> None:
    lessons = QuasiNewtonHistory(3)
    long, short = lessons.for_step_size(0.1), lessons.for_step_size(0.05)
    assert long is not short
    assert lessons.for_step_size(0.104) is long
    assert lessons.for_step_size(0.052) is short
    lessons.reset()
    assert lessons.for_step_size(0.1) is not long
