"""Formulas are read as data: arithmetic comes through, everything else is refused with its place."""

from __future__ import annotations

import math

import casadi
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tautwire.robot.symbolic_equations import CASADI_MATHEMATICS
from tautwire_fmu.laws.expression import (
    MAX_CHARACTERS,
    MAX_NESTING,
    ExpressionError,
    evaluate,
    expression_errors,
    parse_expression,
    variable_names,
)
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, rate_of, with_rate

NAMES = ("x", "vx", "time")
AT = {"x": 0.7, "vx": -1.3, "time": 2.0}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2*3 - 4/8", 6.5),
        ("-x**2", -0.49),
        ("x**-2 + x**0", 0.7**-2 + 1.0),
        ("2e-3*sin(3*time)*exp(-x) + cos(x)/sqrt(time)", 2e-3 * math.sin(6) * math.exp(-0.7) + math.cos(0.7) / 2**0.5),
        ("tanh(vx)*abs(vx) + log(time)", math.tanh(-1.3) * 1.3 + math.log(2.0)),
        ("+(x - 28.9)*--vx", (0.7 - 28.9) * -1.3),
    ],
)
def test_arithmetic_has_its_value(text: str, value: float) -> None:
    assert evaluate(REAL, parse_expression(text, NAMES), AT) == pytest.approx(value, rel=1e-14)


def test_one_tree_serves_every_mathematics() -> None:
    tree = parse_expression("sin(x)**3*vx", NAMES)
    carried = evaluate(COMPLEX_STEP, tree, {**AT, "x": with_rate(0.7, 1.0)})
    assert rate_of(carried) == pytest.approx(3.0 * math.sin(0.7) ** 2 * math.cos(0.7) * -1.3, rel=1e-14)
    x = casadi.SX.sym("x")
    function = casadi.Function("f", [x], [evaluate(CASADI_MATHEMATICS, tree, {**AT, "x": x})])
    assert float(function(0.7)) == pytest.approx(evaluate(REAL, tree, AT), rel=1e-14)


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("x + 2*vx", []),
        ("q + x*p", [1, 7]),
        ("q**2.5 + foo(p, x) - 'a'", [1, 4, 10, 14, 22]),
        ("sin(q, p) + sin(x)", [1, 5, 8]),
        ("x +", [1]),
        ("x" * (MAX_CHARACTERS + 1), [MAX_CHARACTERS]),
    ],
)
def test_all_problems_are_listed_from_left_to_right(text: str, places: list[int]) -> None:
    faults = expression_errors(text, NAMES)
    assert [fault.position for fault in faults] == places
    if places:
        with pytest.raises(ExpressionError) as caught:
            parse_expression(text, NAMES)
        assert str(caught.value) == str(faults[0])


def test_it_says_which_names_it_uses() -> None:
    assert variable_names(parse_expression("x*time + sin(x)", NAMES)) == ("x", "time")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("__import__('os').system('true')", 1),
        ("x + (1).__class__", 5),
        ("x.real", 1),
        ("[x for x in (1, 2)]", 1),
        ("(lambda: x)()", 1),
        ("x if x else vx", 1),
        ("x and vx", 1),
        ("x < vx", 1),
        ("1 + open('a')", 5),
        ("sin(x, vx)", 1),
        ("sin(*x)", 5),
        ("sin(x=1)", 1),
        ("sin", 1),
        ("x[0]", 1),
        ("'x'", 1),
        ("f'{x}'", 1),
        ("True", 1),
        ("1j", 1),
        ("None", 1),
        ("...", 1),
        ("y + 1", 1),
        ("x := 1", 3),
        ("x ** 9", 6),
        ("9 ** 9 ** 9", 6),
        ("x ** vx", 6),
        ("x ** 0.5", 6),
        ("x ** True", 6),
        ("x % 2", 1),
        ("x // 2", 1),
        ("x @ vx", 1),
        ("~x", 1),
        ("x; vx", 2),
        ("", 1),
        ("1e999", 1),
        ("9" * 400, 1),
    ],
)
def test_all_else_is_refused_with_its_place(text: str, place: int) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_expression(text, NAMES)
    assert caught.value.position == place
    assert caught.value.hint


@pytest.mark.parametrize(
    "text",
    [
        "(" * 300 + "x" + ")" * 300,
        "-" * 1500 + "x",
        "+".join(["x"] * (MAX_NESTING + 2)),
        "sin(" * (MAX_NESTING + 1) + "x" + ")" * (MAX_NESTING + 1),
        "x" + " " * MAX_CHARACTERS,
        "\uff58",
        "x\u200b",
        "x\nvx",
        "x\x00",
    ],
)
def test_what_is_too_long_too_deep_or_looks_like_something_else_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError):
        parse_expression(text, NAMES)


@pytest.mark.validate
@given(st.text(max_size=60))
@settings(max_examples=200, deadline=None)
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        tree = parse_expression(text, NAMES)
    except ExpressionError:
        return
    assert set(variable_names(tree)) <= set(NAMES)
