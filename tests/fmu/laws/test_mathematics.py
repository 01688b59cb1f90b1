import math

import pytest

from tautwire_fmu.laws.mathematics import (
    COMPLEX_STEP,
    REAL,
    all_with_rates,
    rate_of,
    rates_of,
    vector_with_rates,
    with_rate,
)


@pytest.mark.parametrize(
    ("name", "at", "slope"),
    [
        ("log", 0.7, 1 / 0.7),
        ("exp", 0.3, math.exp(0.3)),
        ("sqrt", 2.0, 0.5 / math.sqrt(2.0)),
        ("sin", 1.1, math.cos(1.1)),
        ("cos", 1.1, -math.sin(1.1)),
        ("tanh", 0.4, 1.0 - math.tanh(0.4) ** 2),
        ("absolute", -0.4, -1.0),
    ],
)
def test_complex_step_is_exact(name: str, at: float, slope: float) -> None:
    value = getattr(COMPLEX_STEP, name)(with_rate(at, 3.0))
    assert rate_of(value) == pytest.approx(3.0 * slope, rel=1e-15)
    assert value.real == pytest.approx(getattr(REAL, name)(at), rel=1e-15)


def test_piecewise_functions_choose_by_the_real_part() -> None:
    assert rate_of(COMPLEX_STEP.maximum(with_rate(1.0, 2.0), with_rate(0.5, 7.0))) == 2.0
    assert rate_of(COMPLEX_STEP.where(with_rate(-1.0, 1.0), with_rate(0.0, 2.0), with_rate(0.0, 5.0))) == 5.0
    assert REAL.where(1.0, 2.0, 3.0) == 2.0
    assert REAL.where(0.0, 2.0, 3.0) == 3.0


def test_vectors_carry_their_rates_as_numbers_do() -> None:
    values, rates = (1.5, -2.0, 0.25), (3.0, 0.1, -7.0)
    carried = vector_with_rates(values, rates)
    assert (
        list(carried) == all_with_rates(values, rates) == [with_rate(v, r) for v, r in zip(values, rates, strict=True)]
    )
    assert rates_of(carried) == tuple(map(rate_of, carried)) == pytest.approx(rates, rel=1e-15)


def test_a_constant_has_no_rate() -> None:
    assert rate_of(4.0) == 0.0  # type: ignore[arg-type]


@pytest.mark.parametrize("function", ["log", "sqrt"])
def test_a_number_with_its_rate_is_refused_where_the_real_one_is(function: str) -> None:
    for mathematics, number in ((REAL, -2.0), (COMPLEX_STEP, with_rate(-2.0, 1.0))):
        with pytest.raises(ValueError):
            getattr(mathematics, function)(number)
