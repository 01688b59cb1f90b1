"""Terms as texts: the same formula open and closed, with as many digits as are known."""

from dataclasses import replace

import pytest

from tautwire.estimation.discovery.candidate_terms import (
    SHAPE_PARAMETER,
    Term,
    formula_text,
    numeric_formulas,
    parametrised_formulas,
    rounded_to_uncertainty,
)
from tautwire.robot.schema import Formula
from tests.support.robots import example

WAVE = Term("force_x", f"sin({SHAPE_PARAMETER}*time)", family="time", shape=10.68129)
TERMS = {
    WAVE: -9.94531,
    replace(WAVE, target="force_y"): 5.19,
    Term("force_x", "vy"): 31.24999,
    Term("tension", "travel**2", (2,)): 4.0,
    Term("force_y", "1"): -2.0,
}
DEVIATIONS = {"c1": 0.03, "c2": 0.02, "c3": 0.4, "c4": 0.011, "c5": 0.2, "w1": 2e-4}


def test_terms_of_one_shape_share_its_number() -> None:
    rope, x, y = parametrised_formulas(TERMS)
    assert (x.target, x.text) == ("force_x", "c1*sin(w1*time) + c3*vy")
    assert x.numbers == {"c1": -9.94531, "w1": 10.68129, "c3": 31.24999}
    assert (y.text, y.numbers["w1"]) == ("c2*sin(w1*time) + c5*1", 10.68129)
    assert (rope.target, rope.cables) == ("tension", (2,))


def test_numbers_have_the_digits_that_are_known() -> None:
    rope, x, y = numeric_formulas(TERMS, DEVIATIONS)
    assert x == Formula("force_x", "-9.945*sin(10.68129*time) + 31.25*vy")
    assert y == Formula("force_y", "5.19*sin(10.68129*time) - 2")
    assert rope == Formula("tension", "4*travel**2", (2,))


@pytest.mark.parametrize(
    ("value", "deviation", "text"),
    [
        (12345.678, 20.0, "12346"),
        (1.23456e-9, 2e-11, "1.235e-09"),
        (0.5, 30.0, "0.5"),
        (3.0, 0.0, "3.0"),
        (3.0, float("nan"), "3.0"),
    ],
)
def test_a_number_has_one_digit_more_than_its_deviation(value: float, deviation: float, text: str) -> None:
    assert rounded_to_uncertainty(value, deviation) == text


def test_a_formula_is_told_with_its_place() -> None:
    ropes = (Formula("tension", "4*travel", (2,)), Formula("tension", "time", (1, 2, 3)))
    formulas = (*ropes, Formula("force_y", "vx"))
    assert formula_text(example("three"), formulas) == "tension_2 = 4*travel; tension = time; force_y = vx"
