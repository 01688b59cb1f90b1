"""The next pass of a step, found from earlier ones."""

import numpy as np
import pytest

from tautwire.master.acceleration import Lessons, Secants

SLOWLY = np.array([[0.6, 0.2, 0.0], [0.1, 0.5, -0.3], [0.0, 0.2, 0.4]])
OFFSET = np.array([1.0, -2.0, 0.5])
SOLUTION = np.linalg.solve(np.eye(3) - SLOWLY, OFFSET)


def passed(given: np.ndarray) -> np.ndarray:
    return SLOWLY @ given + OFFSET


def error_after(redos: int, secants: Secants, given: np.ndarray) -> float:
    secants.begin()
    secants.learn(given, passed(given))
    for _ in range(redos):
        given = secants.next()
        secants.learn(given, passed(given))
    return float(np.max(np.abs(passed(given) - SOLUTION)))


def test_a_linear_coupling_of_three_is_solved_by_four_redos() -> None:
    assert error_after(4, Secants(), np.zeros(3)) < 1e-12


def test_what_one_step_taught_serves_the_next() -> None:
    secants = Secants()
    error_after(4, secants, np.zeros(3))
    assert error_after(1, secants, np.array([5.0, -1.0, 2.0])) < 1e-10
    secants.forget()
    assert error_after(1, secants, np.array([5.0, -1.0, 2.0])) > 1e-3


def test_the_first_redo_of_all_is_a_plain_one() -> None:
    secants = Secants()
    secants.begin()
    secants.learn(np.zeros(3), passed(np.zeros(3)))
    assert secants.next() == pytest.approx(passed(np.zeros(3)))


def test_a_pass_that_repeats_itself_teaches_nothing() -> None:
    secants = Secants()
    secants.begin()
    for _ in range(2):
        secants.learn(SOLUTION, passed(SOLUTION))
    assert secants.contraction() == 1.0
    assert secants.next() == pytest.approx(SOLUTION)


def test_a_pass_shrinks_errors_by_what_the_largest_pair_shows() -> None:
    secants = Secants()
    error_after(4, secants, np.zeros(3))
    assert 0.5 < secants.contraction() < 1.0


def test_lessons_are_kept_by_the_length_of_the_step() -> None:
    lessons = Lessons()
    long, short = lessons.of(0.1), lessons.of(0.05)
    assert long is not short
    assert lessons.of(0.104) is long
    assert lessons.of(0.052) is short
    lessons.forget()
    assert lessons.of(0.1) is not long
