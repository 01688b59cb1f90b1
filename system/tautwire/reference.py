"""The robot as one model in memory, made from the laws that the FMUs carry: what a co-simulation is held against."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from .robot import Robot
from .symbolic import symbolic_model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReferenceRun:
    """``time`` (N,) in s, ``position`` and ``velocity`` (N, 3), ``tension`` and ``length`` (N, n); SI units."""

    time: Array
    position: Array
    velocity: Array
    tension: Array
    length: Array


def integrate(
    robot: Robot, time: Array, winch_speed: Array, relative: float = 1e-11, absolute: float = 1e-12
) -> ReferenceRun:
    """Integrate the whole robot over winch speeds that are linear between samples.

    ``time`` (N,), ``winch_speed`` (N, n). Dormand and Prince's method of order 8 (DOP853), begun anew at every
    sample, where the slope of the winch speed jumps.
    """
    model = symbolic_model(robot)
    rates = casadi.Function("rates", [model.states, model.inputs], [model.rates])
    outputs = casadi.Function("outputs", [model.states, model.inputs], [model.outputs])
    state = np.array(casadi.Function("start", [], [model.start])()["o0"]).ravel()
    states = [state]
    for index in range(len(time) - 1):
        begin, end = float(time[index]), float(time[index + 1])
        slope = (winch_speed[index + 1] - winch_speed[index]) / (end - begin)

        def rate(at: float, y: Array, begin: float = begin, index: int = index, slope: Array = slope) -> Array:
            speed = winch_speed[index] + (at - begin) * slope
            return np.array(rates(y, np.append(speed, np.zeros(3)))).ravel()

        solution = solve_ivp(rate, (begin, end), state, method="DOP853", rtol=relative, atol=absolute)
        state = solution.y[:, -1]
        states.append(state)
    inputs = np.hstack([winch_speed, np.zeros((len(time), 3))])
    shown = np.array(outputs(np.array(states).T, inputs.T)).T
    count = robot.cable_count
    return ReferenceRun(time, shown[:, :3], shown[:, 3:6], shown[:, 6 : 6 + count], shown[:, 6 + count :])
