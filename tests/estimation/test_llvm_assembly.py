"""Assembly against CasADi's own interpreter, operation by operation, to the last bit."""

from collections.abc import Callable

import casadi
import numpy as np
import pytest
from casadi import SX, Function

from tautwire.estimation.llvm_assembly import INSTRUCTIONS, LIBRARY_CALLS, UntranslatableError, llvm_assembly
from tautwire.estimation.native_functions import CompiledFunction

NUMBERS = (-np.inf, -1e300, -2.5, -1.0, -0.3, -1e-310, -0.0, 0.0, 1e-310, 0.3, 1.0, 2.5, 1e300, np.inf, np.nan)
PAIRS = np.array([[a, b] for a in NUMBERS for b in NUMBERS]).T

OPERATIONS: dict[int, Callable[[SX, SX], SX]] = {
    casadi.OP_ADD: lambda a, b: a + b,
    casadi.OP_SUB: lambda a, b: a - b,
    casadi.OP_MUL: lambda a, b: a * b,
    casadi.OP_DIV: lambda a, b: a / b,
    casadi.OP_NEG: lambda a, b: -a,
    casadi.OP_SQ: lambda a, b: a * a,
    casadi.OP_TWICE: lambda a, b: 2.0 * a,
    casadi.OP_INV: lambda a, b: 1.0 / a,
    casadi.OP_LT: lambda a, b: a < b,
    casadi.OP_LE: lambda a, b: a <= b,
    casadi.OP_EQ: lambda a, b: a == b,
    casadi.OP_NE: lambda a, b: a != b,
    casadi.OP_NOT: lambda a, b: casadi.logic_not(a),
    casadi.OP_IF_ELSE_ZERO: lambda a, b: casadi.if_else(a, b, 0.0),
    casadi.OP_SIGN: lambda a, b: casadi.sign(a),
    casadi.OP_EXP: lambda a, b: casadi.exp(a),
    casadi.OP_LOG: lambda a, b: casadi.log(a),
    casadi.OP_POW: lambda a, b: a**b,
    casadi.OP_CONSTPOW: lambda a, b: a**1.7,
    casadi.OP_SQRT: lambda a, b: casadi.sqrt(a),
    casadi.OP_SIN: lambda a, b: casadi.sin(a),
    casadi.OP_COS: lambda a, b: casadi.cos(a),
    casadi.OP_TAN: lambda a, b: casadi.tan(a),
    casadi.OP_ASIN: lambda a, b: casadi.asin(a),
    casadi.OP_ACOS: lambda a, b: casadi.acos(a),
    casadi.OP_ATAN: lambda a, b: casadi.atan(a),
    casadi.OP_ATAN2: casadi.atan2,
    casadi.OP_SINH: lambda a, b: casadi.sinh(a),
    casadi.OP_COSH: lambda a, b: casadi.cosh(a),
    casadi.OP_TANH: lambda a, b: casadi.tanh(a),
    casadi.OP_FABS: lambda a, b: casadi.fabs(a),
    casadi.OP_FMIN: casadi.fmin,
    casadi.OP_FMAX: casadi.fmax,
}


def test_every_operation_of_the_tables_is_tried_here() -> None:
    assert {*LIBRARY_CALLS, *INSTRUCTIONS} - {casadi.OP_ASSIGN} == set(OPERATIONS)


@pytest.mark.parametrize("operation", OPERATIONS)
def test_an_operation_gives_what_casadi_gives(operation: int) -> None:
    a, b = SX.sym("a"), SX.sym("b")
    function = Function("one", [a, b], [OPERATIONS[operation](a, b)])
    used = [function.instruction_id(k) for k in range(function.n_instructions())]
    assert operation in used
    ours = CompiledFunction(function)(PAIRS.shape[1], PAIRS[:1], PAIRS[1:])[0].ravel()
    theirs = np.array(function.map(PAIRS.shape[1])(PAIRS[:1], PAIRS[1:])).ravel()
    np.testing.assert_array_equal(ours, theirs)
    # C leaves open which of two zeros is the smaller.
    if operation not in (casadi.OP_FMIN, casadi.OP_FMAX):
        np.testing.assert_array_equal(np.signbit(ours[~np.isnan(ours)]), np.signbit(theirs[~np.isnan(theirs)]))


def test_constants_keep_all_their_bits() -> None:
    values = [0.1, -1e-310, np.pi, np.inf, -np.inf, np.nan, 1.0000000000000002]
    ours = CompiledFunction(Function("constants", [SX.sym("a")], [SX(values)]))(1, np.zeros((1, 1)))[0]
    np.testing.assert_array_equal(ours.ravel(), values)


def test_an_operation_that_is_in_no_table_is_told() -> None:
    a = SX.sym("a")
    with pytest.raises(UntranslatableError, match="function bell") as told:
        llvm_assembly(Function("bell", [a], [casadi.erf(a)]))
    assert told.value.operation == casadi.OP_ERF
