"""Winch speeds such that the elastic model follows a path: they cancel the static and the inertial stretch.

The model-based compensation that Baklouti et al. 2017 ask for (section 4.1.1) and leave to their reference 34. The
laws are simulated backwards: in each step, of length d from the middle of one to the next, the winch speeds V and the
remaining state s (unstrained lengths, states of effects) solve

    s_j+1 = s_j + d f(p, v, (s_j + s_j+1) / 2, V)         p, v of the path in the middle of the step
    a(p_j+1, v_j+1, s_j+1, V) = acceleration of the path at its end
    N (T(p_j+1, v_j+1, s_j+1, V) - T_0) = 0               N what redundant cables can do to each other

so every effect that the robot file switches on is compensated too.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray
from scipy.linalg import null_space

from ..model.symbolic import Model, symbolic_model
from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from ..trajectory import Trajectory, cable_directions, ideal_winch_speeds
from .errors import StretchError
from .path import Reference, path_tensions

Array = NDArray[np.float64]

# Of a sample; even, so that one ends at the sample itself.
STEPS = 4


@dataclass(frozen=True)
class _Moments:
    """The path at the middle and at the end of J steps, each (J, 3)."""

    middle: tuple[Array, Array]
    end: tuple[Array, Array, Array]


def elastic_reference(robot: Robot, trajectory: Trajectory, times: Array) -> Reference:
    """Winch speeds that make the elastic model follow a path, and what its sensors then show.

    ``times`` (N,) in s at equal distances; speeds are linear in between. Each is the mean over the sample around it,
    so rope let out is right also where the path's acceleration jumps. They start where inelastic cables would, and the
    path is at rest before.

    Raises UnreachableError where a cable would have to push, StretchError where no speeds are found.
    """
    path_tensions(robot, trajectory, times)
    period = float(times[1] - times[0])
    ends = times[0] - 0.5 * period + period / STEPS * np.arange(1, STEPS * len(times) + 1)
    moments = _moments(trajectory, ends, period / STEPS)
    speeds, shown = _backwards(robot, moments, ideal_winch_speeds(robot, trajectory, ends), period / STEPS)
    if not np.all(np.isfinite(speeds)):
        lost = float(ends[np.argmin(np.all(np.isfinite(speeds), axis=1))])
        raise StretchError(robot.name, lost, "follow it with the speeds of inelastic cables, rigid_reference")
    means = speeds.reshape(len(times), STEPS, -1).mean(axis=1)
    ideal = ideal_winch_speeds(robot, trajectory, times)
    # What the first half sample then lets out too little, the second sample does.
    means[1] += means[0] - 0.5 * ideal[0]
    means[0] = ideal[0]
    return Reference(means, ideal, shown[STEPS // 2 - 1 :: STEPS], shown[0, 3:])


def _moments(trajectory: Trajectory, ends: Array, step: float) -> _Moments:
    middles = ends - 0.5 * step
    return _Moments(
        (trajectory.position(middles), trajectory.velocity(middles)),
        (trajectory.position(ends), trajectory.velocity(ends), trajectory.acceleration(ends)),
    )


def _backwards(robot: Robot, moments: _Moments, rigid: Array, step: float) -> tuple[Array, Array]:
    """Winch speeds in each step (J, n), and what sensors show at its end (J, 3 + n)."""
    model = symbolic_model(robot)
    count = robot.cable_count
    free = np.array([null_space(unit).ravel() for unit in cable_directions(robot, moments.end[0])])
    given = np.hstack([*moments.middle, *moments.end, rigid, free.reshape(len(rigid), -1)])
    start = np.asarray(casadi.evalf(model.start[6:])).ravel()
    march = _step(robot, model, step, given.shape[1]).mapaccum(len(given))
    _, found = march(start, given.T)
    values = np.asarray(found).T
    return values[:, :count], values[:, count:]


def _step(robot: Robot, model: Model, step: float, width: int) -> casadi.Function:
    """From the state at the begin of a step, and the path in it, to the state at its end, winch speeds and outputs."""
    count, size = robot.cable_count, model.states.numel() - 6
    state, after, given, speeds = (
        SX.sym(name, length) for name, length in (("s", size), ("t", size), ("g", width), ("v", count))
    )
    p, v, p_end, v_end, a_end, guess, free = casadi.vertsplit(given, [0, 3, 6, 9, 12, 15, 15 + count, width])
    inputs = casadi.vertcat(speeds, SX(3, 1))
    laws = casadi.Function("laws", [model.states, model.inputs], [model.rates, model.outputs, model.span_tensions])
    between, _, _ = laws(casadi.vertcat(p, v, 0.5 * (state + after)), inputs)
    rates, outputs, tensions = laws(casadi.vertcat(p_end, v_end, after), inputs)
    spare = casadi.reshape(free, count - 3, count) if count > 3 else SX(0, count)
    equations = casadi.vertcat(
        after - state - step * between[6:],
        rates[3:6] - a_end,
        casadi.mtimes(spare, tensions - static_tensions(robot)),
    )
    residual = casadi.Function("residual", [casadi.vertcat(after, speeds), casadi.vertcat(state, given)], [equations])
    solve = casadi.rootfinder("solve", "newton", residual, {"error_on_fail": False})
    solution = solve(casadi.vertcat(state, guess), casadi.vertcat(state, given))
    shown = casadi.vertcat(outputs[:3], outputs[6 : 6 + count])
    there, speed = casadi.vertsplit(solution, [0, size, size + count])
    show = casadi.Function("show", [after, speeds, given], [shown])
    return casadi.Function("step", [state, given], [there, casadi.vertcat(speed, show(there, speed, given))])
