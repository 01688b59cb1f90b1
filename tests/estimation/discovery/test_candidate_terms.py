"""Choosing a few terms out of many by their slopes."""

import numpy as np
import pytest

from tautwire.estimation.discovery.candidate_terms import Term
from tautwire.estimation.discovery.term_selection import NormalEquations, select_terms
from tautwire.estimation.policy import DEFAULT_POLICY

ROWS, MANY = 2000, 60
TERMS = tuple(Term("force_x", f"vx**{power % 8}*{power}") for power in range(MANY))


def slopes(seed: int, truth: dict[int, float], nuisance: float = 0.0) -> NormalEquations:
    """Of innovations that these coefficients explain, beside one nuisance, with noise of one."""
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(ROWS, 1 + MANY)) @ (np.eye(1 + MANY) + 0.3 * random.normal(size=(1 + MANY, 1 + MANY)))
    values = random.normal(size=ROWS) - nuisance * matrix[:, 0]
    for term, coefficient in truth.items():
        values = values - coefficient * matrix[:, 1 + term]
    return NormalEquations(1, TERMS, matrix.T @ matrix, matrix.T @ values, ROWS)


def chosen(found: NormalEquations, present: dict[Term, float]) -> dict[Term, float]:
    return select_terms(found, present, lambda: None)


@pytest.mark.parametrize("seed", range(5))
def test_the_terms_that_act_are_chosen_with_their_coefficients(seed: int) -> None:
    result = chosen(slopes(seed, {3: 0.4, 17: -0.2, 40: 0.1}, nuisance=2.0), {})
    assert set(result) == {TERMS[3], TERMS[17], TERMS[40]}
    assert [result[TERMS[i]] for i in (3, 17, 40)] == pytest.approx([0.4, -0.2, 0.1], abs=0.05)


@pytest.mark.parametrize("seed", range(20))
def test_of_noise_nothing_is_chosen(seed: int) -> None:
    assert chosen(slopes(seed, {}, nuisance=1.0), {}) == {}


def test_what_is_there_already_is_chosen_again_at_its_whole_value() -> None:
    result = chosen(slopes(1, {3: 0.1}), {TERMS[3]: 1.0})
    assert result == pytest.approx({TERMS[3]: 1.1}, abs=0.05)


def test_a_term_that_was_wrong_goes() -> None:
    assert set(chosen(slopes(2, {3: 0.5, 5: -0.3}), {TERMS[5]: 0.3})) == {TERMS[3]}


def test_no_more_than_a_few_are_chosen() -> None:
    assert len(chosen(slopes(3, dict.fromkeys(range(12), 0.5)), {})) == DEFAULT_POLICY.discovery.formulas.max_terms


def test_a_term_without_slopes_is_left_alone() -> None:
    result = slopes(4, {3: 0.5})
    result.fisher_information[8, :] = result.fisher_information[:, 8] = result.score[8] = 0.0
    assert set(chosen(result, {})) == {TERMS[3]}
