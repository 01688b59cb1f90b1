"""Smoothed initial state of a run, from which a co-simulation starts.

Fixed-point smoothing of the filter's first state by all samples: with whitened innovations ``e_k`` and their slopes
``J_k`` by it

    x_0|N = x_0 - P_0 sum_k J_k' e_k

Source: Anderson and Moore (1979), Optimal Filtering, sec. 7.2.
"""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
from numpy.typing import NDArray

from ...model.symbolic import SymbolicModel
from ...robots.robot import InitialState, Robot
from ...runs.start import with_start
from ...statics.equilibrium import static_tensions
from ..data import DataSet
from ..filter_step import Noise
from ..fit import Fitter
from ..likelihood import Likelihood
from ..linearisation import linearise_filter

Array = NDArray[np.float64]


def is_initial_state_uncertain(noise: Noise) -> bool:
    """Whether the initial state is uncertain beyond the sensors' noise."""
    return max(noise.start_velocity, noise.start_stretch, noise.self_stress) > 0.0


def with_initial_state(fitter: Fitter, robot: Robot, sample: DataSet) -> Robot:
    """The robot with the smoothed initial state of a recording; at rest where the recording starts at rest."""
    robot_at_start = with_start(robot, sample.start)
    if not is_initial_state_uncertain(fitter.noise):
        return robot_at_start
    likelihood, values = fitter.likelihood(robot, (), sample)
    state = _smoothed_initial_state(likelihood, values, sample)
    x, y, z, vx, vy, vz = state[:6].tolist()
    smoothed_robot = with_start(robot_at_start, (x, y, z))
    velocity = (vx, vy, vz) if fitter.noise.start_velocity > 0.0 else (0.0, 0.0, 0.0)
    extra_tensions = _static_tensions_of(likelihood.model, state, robot.cable_count) - static_tensions(smoothed_robot)
    return replace(smoothed_robot, initial_state=InitialState(velocity, tuple(extra_tensions.tolist())))


def initial_state_note(robot: Robot, path: str) -> tuple[str, ...]:
    """A note of the initial state of a recording where it is not the robot file's."""
    release = robot.initial_state
    if release is None:
        return ()
    tensions = ", ".join(f"{tension:.4g}" for tension in static_tensions(robot) + np.array(release.tensions))
    speed = float(np.linalg.norm(release.velocity))
    moving = f", at {speed:.3g} m/s" if speed > 0.0 else ""
    return (f"{path}: the run starts with tensions of {tensions} N{moving}, as what was measured says",)


def _smoothed_initial_state(likelihood: Likelihood, values: list[float], sample: DataSet) -> Array:
    """Initial state (n,), smoothed by all samples of the recording."""
    state, covariance = likelihood.start(values)
    state_sensitivities = np.eye(len(state))
    score = np.zeros(len(state))
    for segment in linearise_filter(likelihood, values, sample.recording):
        count = len(segment.is_recorded)
        no_direct_sensitivity = np.zeros((count, len(state), len(state)))
        state_sensitivities, innovation_sensitivities = segment.propagate_sensitivities(
            state_sensitivities, no_direct_sensitivity, np.zeros((count, segment.observed.shape[1], len(state)))
        )
        score += np.einsum("kmp,km->p", innovation_sensitivities, segment.values)
    smoothed: Array = state - covariance @ score
    return smoothed


def _static_tensions_of(model: SymbolicModel, state: Array, cable_count: int) -> Array:
    """Static tensions of the ropes (n,) in N with platform and winches held at a state's position."""
    static_state = state.copy()
    static_state[3:6] = 0.0
    tensions = casadi.Function("tensions", [model.states, model.inputs], [model.span_tensions])
    result: Array = np.array(tensions(static_state, np.zeros(cable_count + 3))).ravel()
    return result
