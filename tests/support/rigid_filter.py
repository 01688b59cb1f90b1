"""A plain extended Kalman filter of a rigid platform with dense matrices, on the textbook equations alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tautwire.recordings.recording import Recording
from tests.support.rigid_motion import RigidRobot

Array = NDArray[np.float64]

STEPS = np.array([1e-6] * 3 + [1e-6] * 3 + [1e-5] * 6)
LENGTH_STEP = 1e-7


def moved(state: Array, error: Array) -> Array:
    """The state with an error of position, rotation and velocities in the world's axes, and of unstrained lengths."""
    rotation = state[6:15].reshape(3, 3)
    turned = Rotation.from_rotvec(error[3:6]).as_matrix() @ rotation
    turning = turned.T @ (rotation @ state[15:18] + error[9:12])
    position, velocity = state[:3] + error[:3], state[3:6] + error[6:9]
    return np.concatenate([position, velocity, turned.ravel(), turning, state[18:] + error[12:]])


def error_between(state: Array, other: Array) -> Array:
    """The error that takes the other state to this one."""
    rotation, reference = (each[6:15].reshape(3, 3) for each in (state, other))
    angle = Rotation.from_matrix(rotation @ reference.T).as_rotvec()
    turning = rotation @ state[15:18] - reference @ other[15:18]
    return np.concatenate([state[:3] - other[:3], angle, state[3:6] - other[3:6], turning, state[18:] - other[18:]])


def innovations_and_variances(
    system: RigidRobot, start: Array, covariance: Array, recording: Recording, noise: Array, speed_noise: float
) -> tuple[Array, Array]:
    """Whitened innovations and logs of their variances (N, m), outputs taken one after the other."""
    state, count = start, recording.cable_count
    steps = np.concatenate([STEPS, np.full(count, LENGTH_STEP)])
    values, log_variances = [], []
    for row in range(recording.sample_count):
        expected, output_matrix = _outputs(system, state, recording.winch_speed[row], steps)
        residual = np.concatenate([recording.position[row], recording.tension[row], np.zeros(3)]) - expected
        measured = Rotation.from_quat(np.roll(recording.orientation[row], -1))
        predicted = Rotation.from_matrix(state[6:15].reshape(3, 3))
        residual[3 + count :] = (measured * predicted.inv()).as_rotvec()
        correction, whitened, logs = np.zeros(len(covariance)), [], []
        for output, direction in enumerate(output_matrix):
            variance = direction @ covariance @ direction + noise[output] ** 2
            innovation = residual[output] - direction @ correction
            gain = covariance @ direction / variance
            correction, covariance = correction + gain * innovation, covariance - np.outer(gain, direction @ covariance)
            whitened.append(innovation / np.sqrt(variance))
            logs.append(np.log(variance))
        values.append(whitened)
        log_variances.append(logs)
        state = moved(state, correction)
        if row + 1 < recording.sample_count:
            ends = recording.winch_speed[row : row + 2], recording.time[row : row + 2]
            state, transition = _transition(system, state, *ends, steps)
            covariance[12:, 12:] += np.eye(count) * (speed_noise * (ends[1][1] - ends[1][0])) ** 2
            covariance = transition @ covariance @ transition.T
    return np.array(values), np.array(log_variances)


def _outputs(system: RigidRobot, state: Array, speed: Array, steps: Array) -> tuple[Array, Array]:
    """Position, tensions and no rotation, and their derivatives by the error."""

    def shown(error: Array) -> Array:
        now = moved(state, error)
        return np.concatenate([now[:3], system.ropes(now, speed)[0], error[3:6]])

    columns = [(shown(step) - shown(-step)) / (2.0 * np.max(step)) for step in np.diag(steps)]
    return shown(np.zeros(len(steps))), np.array(columns).T


def _transition(system: RigidRobot, state: Array, speeds: Array, times: Array, steps: Array) -> tuple[Array, Array]:
    """The state after a sample, and its error by the error before."""
    slope = (speeds[1] - speeds[0]) / (times[1] - times[0])

    def after(begun: Array) -> Array:
        def rates(time: float, now: Array) -> Array:
            return system.rates(now, speeds[0] + slope * (time - times[0]))

        return solve_ivp(rates, tuple(times), begun, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]

    end = after(state)
    columns = [
        error_between(after(moved(state, step)), after(moved(state, -step))) / (2.0 * np.max(step))
        for step in np.diag(steps)
    ]
    return end, np.array(columns).T
