"""Covariance recursion of an extended Kalman filter, compiled by Numba: the loops over a model's compiled functions.

Scalar measurements are processed one by one (their noise is independent), which needs no matrix inverse and skips a
missing one: with variance ``r`` of the noise, row ``h`` of the output matrix, and innovation ``e``

    s = h P h' + r        g = P h' / s        x <- x + g e        P <- P - g h P

Over a step, transition matrices ``F`` of the states that move, beside those that only decay by ``d``:

    P <- [F; diag d] P [F; diag d]' + diag q

Sensitivities to the free parameters are propagated with the gain held fixed. Loops in machine code take a third of the
time of the same operations written out one by one, which outgrow the processor's caches.

Source: Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. 2; Ljung (1999), ch. 11.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic


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


def _compiled(function: Callable[..., None]) -> Callable[..., None]:
    """The function compiled at its first call; kept on disk where there is a folder that can be written."""
    try:
        compiled: Callable[..., None] = njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:
        compiled = njit(nogil=True, error_model="numpy")(function)
    return compiled


@_compiled
def run_recursion(
    outputs_at: int,
    output_places: Any,
    output_strides: Any,
    update_at: int,
    update_places: Any,
    update_strides: Any,
    state: Any,
    covariance: Any,
    sensitivities: Any,
    expected: Any,
    by_state: Any,
    by_parameters: Any,
    moved: Any,
    transition: Any,
    direct: Any,
    decay: Any,
    process_noise: Any,
    measured: Any,
    observed: Any,
    white_variances: Any,
    states: Any,
    covariances: Any,
    values: Any,
    log_variances: Any,
    innovation_sensitivities: Any,
) -> None:
    """Run over the K samples of ``measured`` (K, m); all arrays are in C order.

    ``state`` (n), ``covariance`` (n, n) and ``sensitivities`` (p, n) are changed in place; ``states`` (K + 1, n),
    ``values``, ``log_variances`` (K, m), ``innovation_sensitivities`` (K, p, m) and, unless it is empty,
    ``covariances`` (K, n, n) are filled. The function of the outputs fills ``expected`` (m), ``by_state`` (n, m) and
    ``by_parameters`` (p, m) for ``state``; that of the time update ``moved`` (n), ``transition`` (c, d),
    ``direct`` (p, d), ``decay`` and ``process_noise`` (n): the first d states move by the first c.
    """
    size, parameter_count = len(state), len(sensitivities)
    from_count, moving_count = transition.shape
    output_now, update_now = np.empty_like(output_places), np.empty_like(update_places)
    cross_covariance, correction = np.empty(size), np.empty(size)
    innovation_sensitivity = np.empty(parameter_count)
    propagated = np.empty((moving_count, size))
    for k in range(len(measured)):
        states[k] = state
        if len(covariances):
            covariances[k] = covariance
        output_now[:] = output_places + 8 * k * output_strides
        _call(outputs_at, output_now.ctypes.data, output_strides.ctypes.data)
        correction[:] = 0.0
        for i in range(len(expected)):
            cross_covariance[:] = 0.0
            for j in range(size):
                slope = by_state[j, i]
                if slope != 0.0:
                    for r in range(size):
                        cross_covariance[r] += slope * covariance[j, r]
            variance, innovation = white_variances[i], measured[k, i] - expected[i]
            for j in range(size):
                variance += by_state[j, i] * cross_covariance[j]
                innovation -= by_state[j, i] * correction[j]
            deviation = np.sqrt(variance)
            values[k, i], log_variances[k, i] = innovation / deviation, np.log(variance)
            for a in range(parameter_count):
                total = by_parameters[a, i]
                for j in range(size):
                    total += by_state[j, i] * sensitivities[a, j]
                innovation_sensitivity[a] = -total
                innovation_sensitivities[k, a, i] = -total / deviation
            if observed[k, i] == 0.0:
                continue
            for r in range(size):
                gain = cross_covariance[r] / variance
                correction[r] += gain * innovation
                for a in range(parameter_count):
                    sensitivities[a, r] += gain * innovation_sensitivity[a]
            for r in range(size):
                cross_covariance[r] /= deviation
            for r in range(size):
                factor = cross_covariance[r]
                for j in range(size):
                    covariance[r, j] -= factor * cross_covariance[j]
        state += correction
        update_now[:] = update_places + 8 * k * update_strides
        _call(update_at, update_now.ctypes.data, update_strides.ctypes.data)
        state[:] = moved
        propagated[:] = 0.0
        for r in range(moving_count):
            for j in range(from_count):
                slope = transition[j, r]
                if slope != 0.0:
                    for t in range(size):
                        propagated[r, t] += slope * covariance[j, t]
        for r in range(moving_count, size):
            for j in range(moving_count, size):
                covariance[r, j] *= decay[r] * decay[j]
        for r in range(moving_count):
            for j in range(moving_count, size):
                covariance[r, j] = covariance[j, r] = propagated[r, j] * decay[j]
            for j in range(r, moving_count):
                total = 0.0
                for c in range(from_count):
                    total += transition[c, j] * propagated[r, c]
                covariance[r, j] = covariance[j, r] = total
        for r in range(size):
            covariance[r, r] += process_noise[r]
        for a in range(parameter_count):
            for r in range(moving_count):
                total = direct[a, r]
                for j in range(from_count):
                    total += transition[j, r] * sensitivities[a, j]
                correction[r] = total
            for r in range(moving_count):
                sensitivities[a, r] = correction[r]
            for r in range(moving_count, size):
                sensitivities[a, r] *= decay[r]
    states[len(measured)] = state
