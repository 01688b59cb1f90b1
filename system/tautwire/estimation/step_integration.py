"""Integration of a model over a step, with derivatives, compiled by Numba: loops over a model's compiled functions.

The state moves in small parts by the method of Runge and Kutta. The derivatives weigh errors and may be coarser than
the state, whose own error would pose as an effect: with the Jacobians ``F`` and ``f_p`` of the rates in the middle of a
larger part of length h, to some order,

    Gamma = h (I + h F / 2 (I + h F / 3 (I + h F / 4)))        A = I + F Gamma        B = Gamma f_p

Over twice the time that is ``Gamma + A Gamma``: decays which are far quicker than the step then die, where the series
would blow up. Loops in machine code take a fraction of the time of the same operations written out one by one, which
outgrow the processor's caches.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

AnyFunction = TypeVar("AnyFunction", bound=Callable[..., Any])


def _type_call(_: Any, address: Any, places: Any, strides: Any) -> Any:
    """Calls ``run(1, places, strides)`` of a compiled function at its address."""

    def generate(context: Any, builder: Any, __: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        run_type = ir.FunctionType(ir.VoidType(), [word, word, word])
        run = builder.inttoptr(arguments[0], run_type.as_pointer())
        builder.call(run, [word(1), *arguments[1:]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), generate


_call: Any = intrinsic(_type_call)


def compiled(function: AnyFunction) -> AnyFunction:
    """The function compiled at its first call; kept on disk where there is a folder that can be written."""
    try:
        machine_code: Any = njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:
        machine_code = njit(nogil=True, error_model="numpy")(function)
    return cast(AnyFunction, machine_code)


class Step(NamedTuple):
    """Compiled function of a sample, as :class:`tautwire.estimation.native_functions.BoundFunction` has it.

    That one has to live as long as this.
    """

    address: int
    places: Any
    strides: Any
    results: tuple[Any, ...]


class Division(NamedTuple):
    """How a step is divided: parts for the state, and for the derivatives, their series' order and doublings."""

    state: int
    slope: int
    order: int
    doublings: int


class Integration(NamedTuple):
    """Functions that a step is integrated by, what they read, and what comes out.

    ``preparation`` gives the constants (1, q) of the others: parameters, driving disturbances, uncertain constants, and
    the static start, with the derivatives of the latter by the former (q - s, s), and factors (1, d) of the former's
    driving disturbances. ``part`` takes ``moving`` states (1, n) over the part ``index`` (1, 1) of a step; ``slope``
    gives the Jacobians of the rates at a ``middle`` (1, n) of a part by states (n, n) and by constants (q, n). Without
    sensitivities derivatives are by driving disturbances alone, (d, 0) and (d, n), and c and p are 0.
    ``steps`` (K,) are in s. Results: ``moving``, and derivatives of it by the states before, uncertain constants and
    driving disturbances, ``transition`` (n + c + d, n), and by parameters, ``direct`` (p, n).
    """

    preparation: Step
    part: Step
    slope: Step
    division: Division
    moving: Any
    middle: Any
    constants: Any
    index: Any
    steps: Any
    transition: Any
    direct: Any


@compiled
def assign(target: Any, values: Any) -> None:
    """Set a vector; ``target[:] = values`` takes Numba seconds to compile, for the message where their sizes differ."""
    for i in range(len(target)):
        target[i] = values[i]


@compiled
def assign_matrix(target: Any, values: Any) -> None:
    """Set a matrix, as :func:`assign` sets a vector."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = values[i, j]


@compiled
def add_to_matrix(target: Any, factor: float, values: Any) -> None:
    """Add a multiple of a matrix to another one of its size."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] += factor * values[i, j]


@compiled
def evaluate(step: Step, k: int, places: Any) -> None:
    """Evaluate at sample k; ``places`` belong to the caller, so that they live as long as the call."""
    assign(places, step.places + 8 * k * step.strides)
    _call(step.address, places.ctypes.data, step.strides.ctypes.data)


@compiled
def integrate_step(integration: Integration, state: Any, k: int) -> None:
    """Integrate over the step from sample k, from a filter's ``state``, whose first states are the moving ones."""
    evaluate(integration.preparation, k, np.empty_like(integration.preparation.places))
    assign_matrix(integration.constants, integration.preparation.results[0])
    middles = _move(integration, state, k)
    _differentiate(integration, middles, k)


@compiled
def _move(integration: Integration, state: Any, k: int) -> Any:
    """Move the moving states to the end of the step; returns them in the middle of each larger part, (parts, n)."""
    moving, parts, middle_count = integration.moving[0], integration.division.state, integration.division.slope
    middles, places = np.empty((middle_count, len(moving))), np.empty_like(integration.part.places)
    assign(moving, state)
    for part in range(parts):
        integration.index[0, 0] = part
        evaluate(integration.part, k, places)
        reached = integration.part.results[0][0]
        for j in range(middle_count):
            at = (j + 0.5) / middle_count * parts
            if min(int(at), parts - 1) == part:
                for r in range(len(moving)):
                    middles[j, r] = moving[r] + (at - part) * (reached[r] - moving[r])
        assign(moving, reached)
    return middles


@compiled
def _differentiate(integration: Integration, middles: Any, k: int) -> None:
    """Derivatives of the end of the step, from the Jacobians in the middle of each larger part."""
    division, size, count = integration.division, middles.shape[1], len(integration.slope.results[1])
    part = integration.steps[k] / division.slope
    transition, by_constants, over_part = np.empty((size, size)), np.empty((count, size)), np.empty((size, size))
    places = np.empty_like(integration.slope.places)
    for j in range(division.slope):
        integration.index[0, 0] = j
        assign(integration.middle[0], middles[j])
        evaluate(integration.slope, k, places)
        jacobian, slopes = integration.slope.results
        gamma = _integrated_exponential(jacobian, part, division)
        _set_identity_plus(jacobian, 1.0, gamma, over_part)
        if j == 0:
            assign_matrix(transition, over_part)
            assign_matrix(by_constants, np.dot(slopes, gamma.T))
        else:
            transition = np.dot(over_part, transition)
            by_constants = np.dot(by_constants, over_part.T) + np.dot(slopes, gamma.T)
    _fill_in(integration, transition, by_constants)


@compiled
def _integrated_exponential(jacobian: Any, part: float, division: Division) -> Any:
    """Integral of the matrix exponential over a part: what a constant rate adds to the state."""
    step = part / 2**division.doublings
    series, longer = np.eye(len(jacobian)), np.empty_like(jacobian)
    for term in range(division.order, 1, -1):
        _set_identity_plus(jacobian, step / term, series, longer)
        series, longer = longer, series
    gamma = step * series
    for _ in range(division.doublings):
        _set_identity_plus(jacobian, 1.0, gamma, longer)
        gamma = gamma + np.dot(longer, gamma)
    return gamma


@compiled
def _fill_in(integration: Integration, transition: Any, by_constants: Any) -> None:
    """Sort derivatives by constants, those of the static start by what it depends on, into the results."""
    by_theta, factors = integration.preparation.results[1], integration.preparation.results[2][0]
    theta_count, size, driving = len(by_theta), len(transition), len(factors)
    if by_theta.shape[1] > 0:
        add_to_matrix(by_constants[:theta_count], 1.0, np.dot(by_theta, by_constants[theta_count:]))
    result = integration.transition
    constant_count = len(result) - size - driving
    first_constant = theta_count - constant_count
    assign_matrix(result[:size], transition.T)
    assign_matrix(result[size : size + constant_count], by_constants[first_constant:theta_count])
    for i in range(driving):
        for j in range(size):
            result[size + constant_count + i, j] = factors[i] * by_constants[first_constant - driving + i, j]
    assign_matrix(integration.direct, by_constants)


@compiled
def _set_identity_plus(jacobian: Any, factor: float, matrix: Any, result: Any) -> None:
    """Set ``I + factor F M`` of a Jacobian ``F``, which is stored by columns and mostly zeros, and a matrix ``M``."""
    result[:] = 0.0
    for r in range(len(jacobian)):
        result[r, r] = 1.0
        for c in range(len(jacobian)):
            slope = factor * jacobian[c, r]
            if slope != 0.0:
                for j in range(matrix.shape[1]):
                    result[r, j] += slope * matrix[c, j]
