"""Integration of a model over a step, with derivatives, compiled by Numba: loops over a model's compiled functions.

The state moves in small parts by the method of Runge and Kutta. The derivatives weigh errors and may be coarser than
the state, whose own error would pose as an effect: with the Jacobians ``F`` and ``f_p`` of the rates in the middle of a
larger part of length h, to some order,

    Gamma = h (I + h F / 2 (I + h F / 3 (I + h F / 4)))        A = I + F Gamma        B = Gamma f_p

Over twice the time that is ``Gamma + A Gamma``: decays which are far quicker than the step then die, where the series
would blow up. All of these are computed transposed, as the Jacobians are stored.

Loops in machine code take a fraction of the time of the same operations written out one by one, which outgrow the
processor's caches. They write into buffers that one run makes once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

AnyFunction = TypeVar("AnyFunction", bound=Callable[..., Any])


def _type_call(_: Any, address: Any, first: Any, places: Any, strides: Any) -> Any:
    """Calls ``run(first, 1, places, strides)`` of a compiled function at its address."""

    def generate(context: Any, builder: Any, __: Any, arguments: Any) -> Any:
        address, first_sample, pointers, stride_pointer = arguments
        word = ir.IntType(64)
        run = builder.inttoptr(address, ir.FunctionType(ir.VoidType(), [word] * 4).as_pointer())
        builder.call(run, [first_sample, word(1), pointers, stride_pointer])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 4), generate


_call: Any = intrinsic(_type_call)


def compiled(function: AnyFunction) -> AnyFunction:
    """The function compiled at its first call; kept on disk where there is a folder that can be written.

    It may make no arrays: to count references to arrays would take a seventh of a filter's time.
    """
    return _compiled(function, makes_arrays=False)


def compiled_with_arrays(function: AnyFunction) -> AnyFunction:
    """As :func:`compiled`, of a function that makes arrays, or calls one of NumPy's that may."""
    return _compiled(function, makes_arrays=True)


def _compiled(function: AnyFunction, makes_arrays: bool) -> AnyFunction:
    # A function that is called inherits the option unless it states its own.
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": makes_arrays}
    try:
        machine_code: Any = njit(cache=True, **options)(function)
    except RuntimeError:
        machine_code = njit(**options)(function)
    return cast(AnyFunction, machine_code)


class Step(NamedTuple):
    """Compiled function of a sample, as :class:`tautwire.estimation.native_functions.BoundFunction` has it.

    That one has to live as long as this. ``places`` and ``strides`` are addresses of its arrays.
    """

    address: int
    places: int
    strides: int
    results: tuple[Any, ...]


class Division(NamedTuple):
    """How a step is divided: parts for the state, and for the derivatives, their series' order and doublings."""

    state: int
    slope: int
    order: int
    doublings: int


class IntegrationBuffers(NamedTuple):
    """Buffers of an integration: states in the middle of its larger parts (parts, n), and derivatives, all transposed.

    ``over_part`` and ``by_state`` (n, n) are by the state over a part and over all, ``gamma`` (n, n) is the integrated
    exponential, ``by_constants`` (q, n) over all; ``square`` and ``longer`` (n, n) and ``rows`` (q, n) hold what comes
    next of each.
    """

    middles: Any
    over_part: Any
    by_state: Any
    gamma: Any
    square: Any
    longer: Any
    by_constants: Any
    rows: Any


class Integration(NamedTuple):
    """Functions that a step is integrated by, what they read, and what comes out.

    ``static_start`` gives numbers (1, s) that follow from parameters and ``constant_count`` c uncertain constants, with
    their derivatives by these (p + c, s). ``preparation`` gives the constants (1, q) of the others: parameters, driving
    disturbances, uncertain constants, and the static start, and factors (1, d) of the driving disturbances. ``part``
    takes ``moving`` states (1, n) over the part ``index`` (1, 1) of a step; ``slope`` gives the Jacobians of the rates
    at a ``middle`` (1, n) of a part by states (n, n) and by constants (q, n). Without sensitivities derivatives are by
    driving disturbances alone, (0, s) and (d, n), and c and p are 0. ``steps`` (K,) are in s. Results: ``moving``, and
    derivatives of it by the states before, uncertain constants and driving disturbances, ``transition`` (n + c + d, n),
    and by parameters, ``direct`` (p, n).
    """

    static_start: Step
    constant_count: int
    preparation: Step
    part: Step
    slope: Step
    division: Division
    moving: Any
    middle: Any
    index: Any
    steps: Any
    transition: Any
    direct: Any
    buffers: IntegrationBuffers


def integration_buffers(slope: Step, division: Division) -> IntegrationBuffers:
    """Buffers for the Jacobians that ``slope`` gives."""
    jacobian, by_constants = slope.results
    shapes = [(division.slope, len(jacobian)), *[jacobian.shape] * 5, *[by_constants.shape] * 2]
    return IntegrationBuffers(*(np.empty(shape) for shape in shapes))


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


@compiled_with_arrays
def multiply(left: Any, right: Any, product: Any) -> None:
    """Set the product of two matrices; of none, NumPy's takes as long as of small ones."""
    if product.size > 0:
        np.dot(left, right, product)


@compiled
def evaluate(step: Step, k: int) -> None:
    """Evaluate at sample k."""
    _call(step.address, k, step.places, step.strides)


@compiled
def integrate_step(integration: Integration, state: Any, k: int) -> None:
    """Integrate over the step from sample k, from a filter's ``state``, whose first states are the moving ones.

    The static start is that of this state from then on, until its uncertain constants are updated.
    """
    if integration.constant_count > 0:
        evaluate(integration.static_start, k)
    evaluate(integration.preparation, k)
    _move(integration, state, k)
    _differentiate(integration, k)
    _fill_in(integration)


@compiled
def _move(integration: Integration, state: Any, k: int) -> None:
    """Move the moving states to the end of the step, and record them in the middle of each larger part."""
    moving, parts, middles = integration.moving[0], integration.division.state, integration.buffers.middles
    assign(moving, state)
    for part in range(parts):
        integration.index[0, 0] = part
        evaluate(integration.part, k)
        reached = integration.part.results[0][0]
        for j in range(len(middles)):
            at = (j + 0.5) / len(middles) * parts
            if min(int(at), parts - 1) == part:
                for r in range(len(moving)):
                    middles[j, r] = moving[r] + (at - part) * (reached[r] - moving[r])
        assign(moving, reached)


@compiled
def _differentiate(integration: Integration, k: int) -> None:
    """Derivatives of the end of the step, from the Jacobians in the middle of each larger part."""
    division, buffers = integration.division, integration.buffers
    part = integration.steps[k] / division.slope
    for j in range(division.slope):
        integration.index[0, 0] = j
        assign(integration.middle[0], buffers.middles[j])
        evaluate(integration.slope, k)
        jacobian, slopes = integration.slope.results
        _integrate_exponential(jacobian, part, division, buffers)
        _set_identity_plus(jacobian, buffers.gamma, buffers.over_part)
        if j == 0:
            assign_matrix(buffers.by_state, buffers.over_part)
            multiply(slopes, buffers.gamma, buffers.by_constants)
            continue
        multiply(buffers.by_state, buffers.over_part, buffers.square)
        assign_matrix(buffers.by_state, buffers.square)
        multiply(buffers.by_constants, buffers.over_part, buffers.rows)
        multiply(slopes, buffers.gamma, buffers.by_constants)
        add_to_matrix(buffers.by_constants, 1.0, buffers.rows)


@compiled
def _integrate_exponential(jacobian: Any, part: float, division: Division, buffers: IntegrationBuffers) -> None:
    """Set ``gamma``, the integral of the matrix exponential over a part: what a constant rate adds to the state."""
    step, gamma, longer = part / 2**division.doublings, buffers.gamma, buffers.longer
    for r in range(len(gamma)):
        for c in range(len(gamma)):
            gamma[r, c] = step if r == c else 0.0
    for term in range(division.order, 1, -1):
        multiply(jacobian, gamma, longer)
        for r in range(len(gamma)):
            for c in range(len(gamma)):
                gamma[r, c] = step / term * longer[r, c]
            gamma[r, r] += step
    for _ in range(division.doublings):
        _set_identity_plus(jacobian, gamma, longer)
        multiply(longer, gamma, buffers.square)
        add_to_matrix(gamma, 1.0, buffers.square)


@compiled
def _fill_in(integration: Integration) -> None:
    """Sort derivatives by constants, those of the static start by what it depends on, into the results."""
    slopes, factors = integration.static_start.results[1], integration.preparation.results[1][0]
    by_state, by_constants = integration.buffers.by_state, integration.buffers.by_constants
    size, driving, parameter_count = len(by_state), len(factors), len(integration.direct)
    first_constant = parameter_count + driving
    constants_end = first_constant + integration.constant_count
    if len(slopes) > 0:
        rows = integration.buffers.rows[: len(slopes)]
        multiply(slopes, by_constants[constants_end:], rows)
        add_to_matrix(by_constants[:parameter_count], 1.0, rows[:parameter_count])
        add_to_matrix(by_constants[first_constant:constants_end], 1.0, rows[parameter_count:])
    result = integration.transition
    assign_matrix(result[:size], by_state)
    first_driving = size + integration.constant_count
    assign_matrix(result[size:first_driving], by_constants[first_constant:constants_end])
    for i in range(driving):
        for j in range(size):
            result[first_driving + i, j] = factors[i] * by_constants[parameter_count + i, j]
    assign_matrix(integration.direct, by_constants)


@compiled
def _set_identity_plus(left: Any, right: Any, matrix: Any) -> None:
    """Set the identity plus a product of two square matrices."""
    multiply(left, right, matrix)
    for r in range(len(matrix)):
        matrix[r, r] += 1.0
