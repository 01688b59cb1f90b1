"""Nonsmooth and nonlinear behaviour near the operating point that a linear plant leaves out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ..robot.schema import Robot
from ..robot.symbolic_model import SymbolicModel
from .modes import Modes
from .operating_point import slack_cables

Array = NDArray[np.float64]

DEFAULT_SWING = 5e-3
MAX_RELATIVE_DEVIATION = 0.05
# Tension swings below this share of the largest are not judged; nor are changes below a share of the tension.
MIN_SWING_SHARE, MIN_CHANGE_SHARE = 0.01, 1e-4
SAMPLES_PER_PERIOD = 64


@dataclass(frozen=True)
class OperatingPoint:
    """An operating point: ``state``, cable ``tensions`` (n,) in N, and their ``tension_slopes`` (n, d) by the pose."""

    robot: Robot
    model: SymbolicModel
    state: Array
    tensions: Array
    tension_slopes: Array


def validity_notes(
    operating_point: OperatingPoint, matrices: Sequence[Array], modes: Modes, swing: float = DEFAULT_SWING
) -> tuple[str, ...]:
    """Limits of validity of the linear plant for a swing of ``swing`` (m), one line each; empty if it holds.

    Slack: a cable carries nothing at rest, or goes slack within the swing in some mode. Effects: in a period of the
    nonlinear free oscillation, or with one winch at the speed of the slowest one, tensions or rope speeds differ from
    the linear ones by more than 5 % of their change; Coulomb friction at rest does that at any amplitude. Sensors:
    their delays.
    """
    slack = slack_cables(operating_point.tensions)
    notes = [
        f"cable {cable + 1} is slack: it carries no tension, and the plant holds only while it stays slack"
        for cable in slack
    ]
    slack_swings = _slack_swings(operating_point.tensions, operating_point.tension_slopes @ modes.shapes)
    notes += [
        f"cable {cable + 1} becomes slack at an amplitude of {slack_swings[cable]:.2g} m"
        for cable in np.setdiff1d(np.flatnonzero(slack_swings <= swing), slack)
    ]
    if (operating_point.robot.effects or operating_point.robot.formulas) and swing > 0.0:
        amplitude = min(swing, 0.5 * float(np.min(slack_swings)))
        notes += _swing_notes(operating_point, matrices, modes, amplitude)
        notes += _winch_notes(operating_point, matrices, 2.0 * np.pi * float(modes.frequencies[0]) * amplitude)
    return (*notes, *_delay_notes(operating_point.model, operating_point.robot.cable_count))


def _slack_swings(tensions: Array, tension_slopes: Array) -> Array:
    """Smallest amplitude over all modes, in m, at which each cable goes slack; slopes (n, d) in N/m, one a mode."""
    steepest = np.max(np.abs(tension_slopes), axis=1)
    return np.divide(tensions, steepest, out=np.full(len(tensions), np.inf), where=(steepest > 0.0) & (tensions > 0.0))


def _effect_description(robot: Robot) -> str:
    names = dict.fromkeys([*(setting.name for setting in robot.effects), *(["formula"] if robot.formulas else [])])
    return f"an effect ({', '.join(names)}) is nonsmooth or strongly nonlinear near rest"


def _swing_notes(
    operating_point: OperatingPoint, matrices: Sequence[Array], modes: Modes, amplitude: float
) -> list[str]:
    notes = []
    for mode, frequency in enumerate(modes.frequencies):
        offset = np.zeros(len(operating_point.state))
        offset[operating_point.model.indices.pose] = amplitude * modes.shapes[:, mode]
        deviations = _swing_deviations(
            operating_point, matrices, offset, np.linspace(0.0, 1.0 / frequency, SAMPLES_PER_PERIOD)
        )
        cable = int(np.argmax(deviations))
        if not deviations[cable] <= MAX_RELATIVE_DEVIATION:
            notes.append(
                f"mode {mode + 1}: at an amplitude of {amplitude:.2g} m the tension of cable {cable + 1} deviates from "
                f"the linear plant by {deviations[cable]:.0%} of its amplitude; "
                f"{_effect_description(operating_point.robot)}"
            )
    return notes


def _swing_deviations(operating_point: OperatingPoint, matrices: Sequence[Array], offset: Array, times: Array) -> Array:
    """Relative deviation of the nonlinear from the linear tensions in a free oscillation, shape (n,)."""
    A, _, C, _ = matrices
    model, tension_rows = operating_point.model, operating_point.model.indices.tensions
    zero_inputs = np.zeros(model.inputs.numel())
    laws = casadi.Function("laws", [model.states, model.inputs], [model.rates, model.outputs])
    step = expm(A * (times[1] - times[0]))
    linear = [offset]
    for _ in times[1:]:
        linear.append(step @ linear[-1])
    expected = np.array(linear) @ C[tension_rows].T
    run = solve_ivp(
        lambda _, x: np.asarray(laws(x, zero_inputs)[0]).ravel(),
        (times[0], times[-1]),
        operating_point.state + offset,
        method="LSODA",
        t_eval=times,
        rtol=1e-8,
        atol=1e-12,
    )
    if not run.success:
        return np.full(operating_point.robot.cable_count, np.inf)
    rest_tensions, *swing_tensions = [
        np.asarray(laws(x, zero_inputs)[1]).ravel()[tension_rows] for x in (operating_point.state, *run.y.T)
    ]
    amplitudes = np.max(np.abs(expected), axis=0)
    deviations: Array = np.max(np.abs(swing_tensions - rest_tensions - expected), axis=0) / np.maximum(
        amplitudes, MIN_SWING_SHARE * np.max(amplitudes)
    )
    return deviations


def _winch_notes(operating_point: OperatingPoint, matrices: Sequence[Array], speed: float) -> list[str]:
    """Notes on winches at ``speed`` (m/s) in either direction: immediate tension change and rate of rope length."""
    _, B, _, D = matrices
    model, count = operating_point.model, operating_point.robot.cable_count
    indices = model.indices
    evaluate = casadi.Function(
        "told", [model.states, model.inputs], [model.outputs[indices.tensions], model.rates[indices.lengths]]
    )
    tension, rate = (
        np.asarray(value).ravel() for value in evaluate(operating_point.state, np.zeros(model.inputs.numel()))
    )
    deviations: dict[int, float] = {}
    for winch in range(count):
        worst = 0.0
        for winch_speed in (speed, -speed):
            inputs = np.zeros(model.inputs.numel())
            inputs[winch] = winch_speed
            moved_tension, moved_rate = (np.asarray(value).ravel() for value in evaluate(operating_point.state, inputs))
            floor = MIN_CHANGE_SHARE * np.max(operating_point.tensions)
            worst = max(
                worst,
                _relative_deviation(
                    moved_tension[winch] - tension[winch], D[indices.tensions][winch, winch] * winch_speed, floor
                ),
                _relative_deviation(
                    moved_rate[winch] - rate[winch],
                    B[indices.lengths][winch, winch] * winch_speed,
                    MIN_CHANGE_SHARE * speed,
                ),
            )
        if not worst <= MAX_RELATIVE_DEVIATION:
            deviations[winch + 1] = worst
    if not deviations:
        return []
    return [
        f"winches {', '.join(map(str, deviations))}: at {speed:.2g} m/s tension or rope of their cables deviates from "
        f"the linear plant by up to {max(deviations.values()):.0%} of the change; "
        f"{_effect_description(operating_point.robot)}"
    ]


def _relative_deviation(change: float, linear: float, floor: float) -> float:
    return abs(change - linear) / max(abs(change), abs(linear), floor)


def _delay_notes(model: SymbolicModel, count: int) -> list[str]:
    """Notes on sensor delays."""
    delays = np.asarray(casadi.evalf(model.sensor_delays), dtype=float).ravel()
    sensor_delays = [
        ("positions", float(delays[0])),
        *((f"tension {i + 1}", float(delays[3 + i])) for i in range(count)),
    ]
    return [f"{what}: sensors are {lag:g} s late, which the plant omits" for what, lag in sensor_delays if lag > 0.0]
