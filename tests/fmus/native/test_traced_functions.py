"""Laws traced into C: where they are defined is known, also of what no output depends on."""

from __future__ import annotations

import math

import pytest

from tautwire.fmus.native.traced_functions import Columns, TracedFunction, c_source, rates_along, trace_function
from tautwire_fmu.laws.mathematics import Mathematics


def value(function: TracedFunction, x: float) -> tuple[float, bool]:
    result, valid = function.function(x)
    return float(result), bool(valid)


def traced(law: str) -> TracedFunction:
    def equations(m: Mathematics, columns: Columns) -> Columns:
        x = columns["x"][0]
        laws = {
            "unused logarithm": lambda: (m.log(x), x)[1],
            "root": lambda: m.sqrt(x),
            "hidden not a number": lambda: m.maximum((x - 1.0) / (x * x - 1.0), 0.0),
            "exponential": lambda: m.exp(x),
            "absolute": lambda: m.absolute(x),
            "choice": lambda: m.where(x, 2.0 * x, 3.0 * x),
        }
        return {"y": [laws[law]()]}

    return trace_function("law", {"x": 1}, equations)


@pytest.mark.parametrize(
    ("law", "inside", "outside"),
    [
        ("unused logarithm", 1e-300, 0.0),
        ("root", 0.0, -1e-300),
        ("hidden not a number", 2.0, 1.0),
        ("exponential", 709.0, 710.0),
        ("absolute", -1e300, math.nan),
        ("choice", 0.0, math.inf),
    ],
)
def test_domains_are_those_of_floats(law: str, inside: float, outside: float) -> None:
    function = traced(law)
    assert value(function, inside)[1]
    assert not value(function, outside)[1]


def test_a_choice_takes_the_second_at_zero() -> None:
    assert value(traced("choice"), 1.0)[0] == 2.0
    assert value(traced("choice"), -1.0)[0] == -3.0


@pytest.mark.parametrize(("x", "slope"), [(0.0, 1.0), (-2.0, -1.0), (3.0, 1.0)])
def test_rates_at_a_corner_are_those_of_complex_steps(x: float, slope: float) -> None:
    def equations(m: Mathematics, columns: Columns) -> Columns:
        return {"rate": rates_along([m.absolute(columns["x"][0])], columns["x"], [1.0])}

    rate, valid = trace_function("corner", {"x": 1}, equations).function(x)
    assert (float(rate), bool(valid)) == (slope, True)


def test_nothing_in_the_source_is_visible_outside() -> None:
    source = c_source([traced("absolute"), traced("root")])
    definitions = [line for line in source.splitlines() if line.endswith("{") and not line.startswith((" ", "}"))]
    assert len(definitions) >= 4
    assert all(line.startswith("static ") for line in definitions)
