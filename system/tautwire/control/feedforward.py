"""Feedforward references along a path: for inelastic cables, and by inverse simulation of the elastic model.

The model-based compensation that Baklouti et al. 2017 ask for (section 4.1.1) and leave to their reference 34. The
laws are inverted: in each step, of length d from the middle of one sample to the next, the winch speeds V and the
remaining state s (unstrained lengths, states of effects) solve

    s_j+1 = s_j + d f(p, v, (s_j + s_j+1) / 2, V)         p, v of the path in the middle of the step
    a(p_j+1, v_j+1, s_j+1, V) = acceleration of the path at its end
    N (T(p_j+1, v_j+1, s_j+1, V) - T_0) = 0               N the self-stress of redundant cables

so every effect of the robot file is compensated too.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray
from scipy.linalg import null_space

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, total_mass

from ..errors import UnreachableError
from ..robot.active_effects import platform_effects
from ..robot.schema import Robot, require_point_mass
from ..robot.static_equilibrium import static_tensions
from ..robot.static_load import load_on_tensions
from ..robot.symbolic_model import SymbolicModel, symbolic_model
from ..robot.trajectory import Trajectory, cable_directions, ideal_winch_speeds
from .design import StretchError

Array = NDArray[np.float64]

# Per sample; even, so that one ends at the sample itself.
SUBSTEPS = 4


@dataclass(frozen=True)
class Reference:
    """Reference of a controller at each of N samples: winch speeds (N, n) in m/s, and expected measurements.

    ``rigid`` (N, n) are the speeds for inelastic cables; ``expected`` (N, 3 + n): position in m, tensions in N.
    ``at_rest`` (n,) are the expected tensions before the start, in N.
    """

    speeds: Array
    rigid: Array
    expected: Array
    at_rest: Array


def path_tensions(robot: Robot, trajectory: Trajectory, times: Array) -> Array:
    """Inverse dynamics: tensions that carry the platform along a path, shape (N, n), in N.

    ``T = T_0 + U^+ (w + m a - U T_0)``, ``w`` the static load: of all that move it, those nearest to the start's.

    Raises UnreachableError where a cable would have to push.
    """
    require_point_mass(robot.name, robot)
    start = static_tensions(robot)
    positions = trajectory.position(times)
    direction_matrix = cable_directions(robot, positions)
    constants = PointMassConstants(robot.platform.mass, robot.gravity)
    mass = total_mass(REAL, constants, platform_effects(robot))
    static_loads = np.array([load_on_tensions(robot, position, start) for position in positions.tolist()])
    load = mass * trajectory.acceleration(times) + static_loads
    change = np.linalg.pinv(direction_matrix) @ (load - direction_matrix @ start)[:, :, None]
    tensions: Array = start + change[:, :, 0]
    if np.min(tensions) < 0.0:
        sample, cable = np.unravel_index(np.argmin(tensions), tensions.shape)
        raise UnreachableError(
            robot.name,
            position=tuple(positions[sample]),
            cable=int(cable) + 1,
            tension=float(tensions[sample, cable]),
            hint=f"choose a slower path, or one that the cables can hold (it fails at {times[sample]:g} s)",
        )
    return tensions


def rigid_reference(robot: Robot, trajectory: Trajectory, times: Array) -> Reference:
    """Rigid reference: winch speeds of inelastic cables along a path, and the tensions that carry the platform there.

    Raises UnreachableError where a cable would have to push.
    """
    speeds = ideal_winch_speeds(robot, trajectory, times)
    expected = np.hstack([trajectory.position(times), path_tensions(robot, trajectory, times)])
    return Reference(speeds, speeds, expected, path_tensions(robot, trajectory, times[:1] - 1.0)[0])


@dataclass(frozen=True)
class _PathSamples:
    """Samples of the path at the middle and at the end of J steps, each (J, 3)."""

    middle: tuple[Array, Array]
    end: tuple[Array, Array, Array]


def elastic_reference(robot: Robot, trajectory: Trajectory, times: Array) -> Reference:
    """Elastic reference: winch speeds with which the elastic model follows a path, and the measurements then expected.

    ``times`` (N,) in s, equidistant; speeds are linear in between. Each is the mean over the sample around it, so the
    rope length is right also where the path's acceleration jumps. They start with those of inelastic cables, and the
    path is at rest before.

    Raises UnreachableError where a cable would have to push, StretchError where no speeds are found.
    """
    path_tensions(robot, trajectory, times)
    period = float(times[1] - times[0])
    ends = times[0] - 0.5 * period + period / SUBSTEPS * np.arange(1, SUBSTEPS * len(times) + 1)
    path_samples = _sample_path(trajectory, ends, period / SUBSTEPS)
    speeds, expected = _simulate_inverse(
        robot, path_samples, ideal_winch_speeds(robot, trajectory, ends), period / SUBSTEPS
    )
    if not np.all(np.isfinite(speeds)):
        failure_time = float(ends[np.argmin(np.all(np.isfinite(speeds), axis=1))])
        raise StretchError(robot.name, failure_time, "follow it with the speeds of inelastic cables, rigid_reference")
    means = speeds.reshape(len(times), SUBSTEPS, -1).mean(axis=1)
    ideal = ideal_winch_speeds(robot, trajectory, times)
    # The second sample makes up for the rope that the first half sample lacks.
    means[1] += means[0] - 0.5 * ideal[0]
    means[0] = ideal[0]
    return Reference(means, ideal, expected[SUBSTEPS // 2 - 1 :: SUBSTEPS], expected[0, 3:])


def _sample_path(trajectory: Trajectory, ends: Array, step: float) -> _PathSamples:
    middles = ends - 0.5 * step
    return _PathSamples(
        (trajectory.position(middles), trajectory.velocity(middles)),
        (trajectory.position(ends), trajectory.velocity(ends), trajectory.acceleration(ends)),
    )


def _simulate_inverse(
    robot: Robot, path_samples: _PathSamples, rigid_speeds: Array, step: float
) -> tuple[Array, Array]:
    """Winch speeds in each step (J, n), and measurements at its end (J, 3 + n)."""
    model = symbolic_model(robot)
    count = robot.cable_count
    null_vectors = np.array([null_space(unit).ravel() for unit in cable_directions(robot, path_samples.end[0])])
    path_data = np.hstack(
        [*path_samples.middle, *path_samples.end, rigid_speeds, null_vectors.reshape(len(rigid_speeds), -1)]
    )
    start = np.asarray(casadi.evalf(model.start[6:])).ravel()
    march = _inverse_step(robot, model, step, path_data.shape[1]).mapaccum(len(path_data))
    _, trajectory_values = march(start, path_data.T)
    values = np.asarray(trajectory_values).T
    return values[:, :count], values[:, count:]


def _inverse_step(robot: Robot, model: SymbolicModel, step: float, width: int) -> casadi.Function:
    """Function of one step: from the initial state and the path to the final state, winch speeds and measurements."""
    count, size = robot.cable_count, model.states.numel() - 6
    state, end_state, path_data, speeds = (
        SX.sym(name, length) for name, length in (("s", size), ("t", size), ("g", width), ("v", count))
    )
    p, v, p_end, v_end, a_end, guess, null_entries = casadi.vertsplit(
        path_data, [0, 3, 6, 9, 12, 15, 15 + count, width]
    )
    inputs = casadi.vertcat(speeds, SX(3, 1))
    laws = casadi.Function("laws", [model.states, model.inputs], [model.rates, model.outputs, model.span_tensions])
    middle_rates, _, _ = laws(casadi.vertcat(p, v, 0.5 * (state + end_state)), inputs)
    rates, outputs, tensions = laws(casadi.vertcat(p_end, v_end, end_state), inputs)
    null_basis = casadi.reshape(null_entries, count - 3, count) if count > 3 else SX(0, count)
    equations = casadi.vertcat(
        end_state - state - step * middle_rates[6:],
        rates[3:6] - a_end,
        casadi.mtimes(null_basis, tensions - static_tensions(robot)),
    )
    residual = casadi.Function(
        "residual", [casadi.vertcat(end_state, speeds), casadi.vertcat(state, path_data)], [equations]
    )
    solve = casadi.rootfinder("solve", "newton", residual, {"error_on_fail": False})
    solution = solve(casadi.vertcat(state, guess), casadi.vertcat(state, path_data))
    sensor_outputs = casadi.vertcat(outputs[:3], outputs[6 : 6 + count])
    solved_state, speed = casadi.vertsplit(solution, [0, size, size + count])
    evaluate_sensors = casadi.Function("show", [end_state, speeds, path_data], [sensor_outputs])
    return casadi.Function(
        "step",
        [state, path_data],
        [solved_state, casadi.vertcat(speed, evaluate_sensors(solved_state, speed, path_data))],
    )
