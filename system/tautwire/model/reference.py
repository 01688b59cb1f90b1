"""The robot as one model in memory, made from the laws that the FMUs carry: what a co-simulation is held against."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ..robots.robot import Robot
from .symbolic import Model, symbolic_model

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
    sample, where the slope of the winch speed jumps. A sensor that lags shows the start until its lag has passed.
    """
    model = symbolic_model(robot)
    outputs = casadi.Function("outputs", [model.states, model.inputs], [model.outputs])
    lags = np.array(casadi.Function("lags", [], [model.lags])()["o0"]).ravel()
    late = {float(lag): np.maximum(time - lag, time[0]) for lag in np.unique(np.append(lags, 0.0))}
    instants = np.unique(np.concatenate(list(late.values())))
    states = _states(model, time, winch_speed, instants, relative, absolute)
    speeds = np.array([np.interp(instants, time, column) for column in winch_speed.T])
    shown = np.array(outputs(states.T, np.vstack([speeds, np.zeros((3, len(instants)))]))).T
    count = robot.cable_count
    columns = np.repeat(0.0, shown.shape[1])
    columns[np.r_[0:3, 6 : 6 + count]] = lags
    rows = np.array([np.searchsorted(instants, late[float(lag)]) for lag in columns]).T
    shown = np.take_along_axis(shown, rows, axis=0)
    return ReferenceRun(time, shown[:, :3], shown[:, 3:6], shown[:, 6 : 6 + count], shown[:, 6 + count :])


def _states(model: Model, time: Array, winch_speed: Array, instants: Array, relative: float, absolute: float) -> Array:
    """States at rising instants, the first of which is the start, shape (instants, states)."""
    rates = casadi.Function("rates", [model.states, model.inputs], [model.rates])
    state = np.array(casadi.Function("start", [], [model.start])()["o0"]).ravel()
    states = [state[None, :]]
    for index in range(len(time) - 1):
        begin, end = float(time[index]), float(time[index + 1])
        slope = (winch_speed[index + 1] - winch_speed[index]) / (end - begin)

        def rate(at: float, y: Array, begin: float = begin, index: int = index, slope: Array = slope) -> Array:
            speed = winch_speed[index] + (at - begin) * slope
            return np.array(rates(y, np.append(speed, np.zeros(3)))).ravel()

        inside = instants[(instants > begin) & (instants <= end)]
        asked = np.unique(np.append(inside, end))
        solution = solve_ivp(rate, (begin, end), state, method="DOP853", t_eval=asked, rtol=relative, atol=absolute)
        state = solution.y[:, -1]
        states.append(solution.y.T[: len(inside)])
    return np.vstack(states)
