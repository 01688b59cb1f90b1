"""Interpolation of inputs and Hermite quadrature, traced from the functions that the Python slaves use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tautwire_fmu.hermite_quadrature import (
    CUBIC_END,
    CUBIC_MIDDLE,
    QUINTIC_END,
    QUINTIC_MIDDLE,
    AccelerationNode,
    MotionState,
    QuadratureWeights,
    cubic_hermite,
    integrate_hermite,
    quintic_hermite,
    taylor_extrapolate,
)
from tautwire_fmu.laws.mathematics import Mathematics

from .traced_functions import Columns, TracedFunction, trace_function

# Position, velocity and acceleration of a cable's end, then the winch speed and its rate.
MOTION_SIZE = 11


def cubic_function() -> TracedFunction:
    """``cubic``: value and rate of the cubic Hermite interpolant; of value and rate at both ends of a step."""
    return trace_function("cubic", {"first": 2, "last": 2, "step": 1, "fraction": 1}, _cubic)


def quintic_function() -> TracedFunction:
    """``quintic``: value, rate and curvature of the quintic Hermite interpolant."""
    return trace_function("quintic", {"first": 3, "last": 3, "step": 1, "fraction": 1}, _quintic)


def motion_functions() -> tuple[TracedFunction, ...]:
    """``extrapolated_motion`` and ``interpolated_motion``: inputs of a cable within a step."""
    return (
        trace_function("extrapolated_motion", {"inputs": MOTION_SIZE, "elapsed": 1}, _extrapolated_motion),
        trace_function(
            "interpolated_motion",
            {"first": MOTION_SIZE, "last": MOTION_SIZE, "step": 1, "fraction": 1},
            _interpolated_motion,
        ),
    )


def quadrature_functions() -> tuple[TracedFunction, ...]:
    """``two_node_quadrature`` and ``three_node_quadrature``: motion in the middle and at the end of a step.

    ``initial`` is position and velocity, a node acceleration and jerk.
    """
    return (
        trace_function("two_node_quadrature", {"initial": 6, "nodes": 12, "step": 1}, _two_nodes),
        trace_function("three_node_quadrature", {"initial": 6, "nodes": 18, "step": 1}, _three_nodes),
    )


def _cubic(m: Mathematics, columns: Columns) -> Columns:
    return {"values": cubic_hermite(columns["first"], columns["last"], columns["step"][0], columns["fraction"][0])}


def _quintic(m: Mathematics, columns: Columns) -> Columns:
    return {"values": quintic_hermite(columns["first"], columns["last"], columns["step"][0], columns["fraction"][0])}


def _extrapolated_motion(m: Mathematics, columns: Columns) -> Columns:
    inputs, elapsed = columns["inputs"], columns["elapsed"][0]
    position, velocity, acceleration, (speed, rate) = inputs[0:3], inputs[3:6], inputs[6:9], inputs[9:11]
    return {
        "motion": [
            *(taylor_extrapolate(x, v, a, elapsed) for x, v, a in zip(position, velocity, acceleration, strict=True)),
            *(v + elapsed * a for v, a in zip(velocity, acceleration, strict=True)),
            *acceleration,
            speed + elapsed * rate,
            rate,
        ]
    }


def _interpolated_motion(m: Mathematics, columns: Columns) -> Columns:
    first, last, step, fraction = columns["first"], columns["last"], columns["step"][0], columns["fraction"][0]
    axes = [quintic_hermite(first[axis:9:3], last[axis:9:3], step, fraction) for axis in range(3)]
    motion = [value for values in zip(*axes, strict=True) for value in values]
    return {"motion": [*motion, *cubic_hermite(first[9:11], last[9:11], step, fraction)]}


def _two_nodes(m: Mathematics, columns: Columns) -> Columns:
    return _quadrature(columns, (CUBIC_MIDDLE, CUBIC_END))


def _three_nodes(m: Mathematics, columns: Columns) -> Columns:
    return _quadrature(columns, (QUINTIC_MIDDLE, QUINTIC_END))


def _quadrature(columns: Columns, weights: Sequence[QuadratureWeights]) -> Columns:
    initial, numbers, step = columns["initial"], columns["nodes"], columns["step"][0]
    start = MotionState(initial[0:3], initial[3:6], ())
    nodes = [AccelerationNode(numbers[k : k + 3], numbers[k + 3 : k + 6]) for k in range(0, len(numbers), 6)]
    middle, end = (_flat(integrate_hermite(start, nodes, step, each)) for each in weights)
    return {"middle": middle, "end": end}


def _flat(state: MotionState) -> list[Any]:
    return [*state.position, *state.velocity, *state.acceleration]
