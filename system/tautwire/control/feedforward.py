"""Feedforward references along a path: for inelastic cables, and by inverse simulation of the elastic model.

The model-based compensation that Baklouti et al. 2017 ask for (section 4.1.1) and leave to their reference 34. The
laws are inverted: in each step, of length d from the middle of one sample to the next, the winch speeds V and the
remaining state s (unstrained lengths, states of effects) solve

    s_j+1 = s_j + d f(x, t, (s_j + s_j+1) / 2, V)         pose x and twist t of the path in the middle of the step
    P a(x_j+1, t_j+1, s_j+1, V) = P dt/dt                 P what the tensions can move, at the end of the step
    N (T(x_j+1, t_j+1, s_j+1, V) - T_j+1) = 0             N the self-stress of redundant cables, T_j+1 along the path

so every effect of the robot file is compensated too. A rigid platform on fewer than six cables is moved through poses
in equilibrium: the cables then exert the wrench nearest to the one that moves it.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from ..robot.pose_path import PoseSamples, pose_path, sample_poses
from ..robot.schema import Robot
from ..robot.trajectory import Trajectory
from ..robot.winch_speeds import winch_speeds_at
from .design import StretchError
from .path_dynamics import START_RULE, PathDynamics, PathLaws, path_dynamics

Array = NDArray[np.float64]

# Per sample; even, so that one ends at the sample itself.
SUBSTEPS = 4
MAX_NEWTON_STEPS = 20
# In m, m/s^2 and N: above what rounding leaves of stiff ropes; the last step is quadratically nearer.
NEWTON_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Reference:
    """Reference of a controller at each of N samples: winch speeds (N, n) in m/s, and expected measurements.

    ``rigid`` (N, n) are the speeds for inelastic cables; ``expected`` (N, 3 + n): position in m, tensions in N, and of
    a rigid platform (N, 7 + n) with a unit quaternion behind the position. ``at_rest`` (n,) are the expected tensions
    before the start, in N.
    """

    speeds: Array
    rigid: Array
    expected: Array
    at_rest: Array


def rigid_reference(robot: Robot, trajectory: Trajectory, times: Array, rule: str = START_RULE) -> Reference:
    """Rigid reference: winch speeds of inelastic cables along a path, and the tensions that carry the platform there.

    ``rule`` distributes the tensions as in :func:`path_tensions`.

    Raises UnreachableError where a cable would have to push, or no tensions are within the limits.
    """
    path, laws = pose_path(robot, trajectory), PathLaws.of(robot)
    poses, at_rest = (sample_poses("rigid_reference", robot, path, at) for at in (times, times[:1] - 1.0))
    speeds = winch_speeds_at(robot, poses)
    tensions = path_dynamics(robot, laws, poses, times, rule).tensions
    start_tensions = path_dynamics(robot, laws, at_rest, times[:1], rule).tensions[0]
    return Reference(speeds, speeds, np.hstack([_measured_pose(robot, poses), tensions]), start_tensions)


def elastic_reference(robot: Robot, trajectory: Trajectory, times: Array, rule: str = START_RULE) -> Reference:
    """Elastic reference: winch speeds with which the elastic model follows a path, and the measurements then expected.

    ``times`` (N,) in s, equidistant; speeds are linear in between. Each is the mean over the sample around it, so the
    rope length is right also where the path's acceleration jumps. They start with those of inelastic cables, and the
    path is at rest before. ``rule`` distributes the tensions as in :func:`path_tensions`.

    Raises UnreachableError where a cable would have to push or no tensions are within the limits, StretchError where no
    speeds are found.
    """
    path, laws = pose_path(robot, trajectory), PathLaws.of(robot)
    period = float(times[1] - times[0])
    step = period / SUBSTEPS
    ends = times[0] - 0.5 * period + step * np.arange(1, SUBSTEPS * len(times) + 1)
    middle, end, at_samples = (
        sample_poses("elastic_reference", robot, path, at) for at in (ends - 0.5 * step, ends, times)
    )
    dynamics = path_dynamics(robot, laws, end, ends, rule)
    speeds, outputs = _simulate_inverse(robot, laws, (middle, end), dynamics, step)
    if not np.all(np.isfinite(speeds)):
        failure_time = float(ends[np.argmin(np.all(np.isfinite(speeds), axis=1))])
        raise StretchError(robot.name, failure_time, "follow it with the speeds of inelastic cables, rigid_reference")
    means = speeds.reshape(len(times), SUBSTEPS, -1).mean(axis=1)
    ideal = winch_speeds_at(robot, at_samples)
    # The second sample makes up for the rope that the first half sample lacks.
    means[1] += means[0] - 0.5 * ideal[0]
    means[0] = ideal[0]
    shown = outputs[SUBSTEPS // 2 - 1 :: SUBSTEPS]
    expected = np.hstack([shown[:, :3], _measured_pose(robot, at_samples)[:, 3:], shown[:, 3:]])
    return Reference(means, ideal, expected, outputs[0, 3:])


def _measured_pose(robot: Robot, poses: PoseSamples) -> Array:
    """Position, and of a rigid platform its orientation behind it, (N, 3) or (N, 7)."""
    return np.hstack([poses.position, poses.orientation]) if robot.platform.is_rigid_body else poses.position


def _simulate_inverse(
    robot: Robot, laws: PathLaws, poses: tuple[PoseSamples, PoseSamples], dynamics: PathDynamics, step: float
) -> tuple[Array, Array]:
    """Winch speeds in each step (J, n), and position and tensions as measured at its end (J, 3 + n)."""
    count, model = robot.cable_count, laws.model
    _, end = poses
    targets = np.einsum("kin,kn->ki", dynamics.null_rows, dynamics.tensions)
    # CasADi stores matrices column by column.
    rows = [np.swapaxes(each, 1, 2).reshape(len(targets), -1) for each in (dynamics.motion_rows, dynamics.null_rows)]
    parts = [
        *(part for each in poses for part in (laws.pose_states(each), each.twist)),
        end.acceleration,
        winch_speeds_at(robot, end),
        *rows,
        targets,
    ]
    widths = [part.shape[1] for part in parts]
    start = np.asarray(casadi.evalf(model.start[model.indices.lengths.start :])).ravel()
    march = _inverse_step(robot, laws, step, widths).mapaccum(len(targets))
    _, trajectory_values = march(start, np.hstack(parts).T)
    values = np.asarray(trajectory_values).T
    return values[:, :count], values[:, count:]


def _inverse_step(robot: Robot, laws: PathLaws, step: float, widths: list[int]) -> casadi.Function:
    """Function of one step: from the initial state and the path to the final state, winch speeds and measurements."""
    model, count = laws.model, robot.cable_count
    d, lengths = model.indices.degrees_of_freedom, model.indices.lengths
    size = model.states.numel() - lengths.start
    state, end_state, path_data, speeds = (
        SX.sym(name, length) for name, length in (("s", size), ("t", size), ("g", sum(widths)), ("v", count))
    )
    x, t, x_end, t_end, a_end, guess, motion_entries, null_entries, target = casadi.vertsplit(
        path_data, np.cumsum([0, *widths]).tolist()
    )
    inputs = casadi.vertcat(speeds, SX(d, 1))
    middle_rates, _, _ = laws.laws(casadi.vertcat(x, t, 0.5 * (state + end_state)), inputs)
    rates, outputs, tensions = laws.laws(casadi.vertcat(x_end, t_end, end_state), inputs)
    rank = motion_entries.numel() // d
    motion_rows = casadi.reshape(motion_entries, rank, d)
    null_rows = casadi.reshape(null_entries, count - rank, count)
    equations = casadi.vertcat(
        end_state - state - step * middle_rates[lengths.start :],
        casadi.mtimes(motion_rows, rates[model.indices.twist] - a_end),
        casadi.mtimes(null_rows, tensions) - target,
    )
    residual = casadi.Function(
        "residual", [casadi.vertcat(end_state, speeds), casadi.vertcat(state, path_data)], [equations]
    )
    # A line search does not end where rounding leaves no descent, and from the step before none is needed.
    options = {
        "error_on_fail": False,
        "show_eval_warnings": False,
        "line_search": False,
        "abstol": NEWTON_TOLERANCE,
        "max_iter": MAX_NEWTON_STEPS,
    }
    solve = casadi.rootfinder("solve", "newton", residual, options)
    # Reeled by inelastic cables' speeds, so that no cable of the guess is slack, where its law has no slope.
    reeled, _, _ = laws.laws(casadi.vertcat(x, t, state), casadi.vertcat(guess, SX(d, 1)))
    guessed = casadi.vertcat(state + step * reeled[lengths.start :], guess)
    solution = solve(guessed, casadi.vertcat(state, path_data))
    solved_state, speed = casadi.vertsplit(solution, [0, size, size + count])
    sensor_outputs = casadi.vertcat(outputs[:3], outputs[model.indices.tensions])
    evaluate_sensors = casadi.Function("show", [end_state, speeds, path_data], [sensor_outputs])
    return casadi.Function(
        "step",
        [state, path_data],
        [solved_state, casadi.vertcat(speed, evaluate_sensors(solved_state, speed, path_data))],
    )
