"""Monolithic reference simulation of the robot, against which a co-simulation is verified."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from .schema import Robot
from .symbolic_model import SymbolicModel, symbolic_model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReferenceRun:
    """Solution in SI units: ``time`` (N,), ``position`` and ``velocity`` (N, 3), ``tension`` and ``length`` (N, n)."""

    time: Array
    position: Array
    velocity: Array
    tension: Array
    length: Array


def integrate(
    robot: Robot, time: Array, winch_speed: Array, relative_tolerance: float = 1e-11, absolute_tolerance: float = 1e-12
) -> ReferenceRun:
    """Integrates the whole robot in one model, with winch speeds that are linear between samples.

    ``time`` (N,), ``winch_speed`` (N, n). Dormand and Prince's method of order 8 (DOP853), restarted at every
    sample, where the slope of the winch speed jumps. A delayed sensor shows the start value until its delay has passed.
    """
    model = symbolic_model(robot)
    outputs = casadi.Function("outputs", [model.states, model.inputs], [model.outputs])
    delays = np.array(casadi.Function("lags", [], [model.sensor_delays])()["o0"]).ravel()
    delayed_times = {float(lag): np.maximum(time - lag, time[0]) for lag in np.unique(np.append(delays, 0.0))}
    evaluation_times = np.unique(np.concatenate(list(delayed_times.values())))
    states = _integrate_states(model, time, winch_speed, evaluation_times, relative_tolerance, absolute_tolerance)
    speeds = np.array([np.interp(evaluation_times, time, column) for column in winch_speed.T])
    output_values = np.array(outputs(states.T, np.vstack([speeds, np.zeros((3, len(evaluation_times)))]))).T
    count = robot.cable_count
    output_delays = np.repeat(0.0, output_values.shape[1])
    output_delays[np.r_[0:3, 6 : 6 + count]] = delays
    rows = np.array([np.searchsorted(evaluation_times, delayed_times[float(lag)]) for lag in output_delays]).T
    output_values = np.take_along_axis(output_values, rows, axis=0)
    return ReferenceRun(
        time,
        output_values[:, :3],
        output_values[:, 3:6],
        output_values[:, 6 : 6 + count],
        output_values[:, 6 + count :],
    )


def _integrate_states(
    model: SymbolicModel,
    time: Array,
    winch_speed: Array,
    evaluation_times: Array,
    relative_tolerance: float,
    absolute_tolerance: float,
) -> Array:
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

        interval_times = evaluation_times[(evaluation_times > begin) & (evaluation_times <= end)]
        solver_times = np.unique(np.append(interval_times, end))
        solution = solve_ivp(
            rate,
            (begin, end),
            state,
            method="DOP853",
            t_eval=solver_times,
            rtol=relative_tolerance,
            atol=absolute_tolerance,
        )
        state = solution.y[:, -1]
        states.append(solution.y.T[: len(interval_times)])
    return np.vstack(states)
