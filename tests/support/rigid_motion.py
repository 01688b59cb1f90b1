"""Motion of rigid cable robots by their textbook equations, integrated as one system; never imports the laws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tautwire.robot.schema import Robot

Array = NDArray[np.float64]


class RigidMotion(NamedTuple):
    """Position and velocity of the origin (N, 3), rotation matrices (N, 3, 3), angular velocity (N, 3), tensions."""

    position: Array
    velocity: Array
    rotation: Array
    angular_velocity: Array
    tension: Array


def rotation_matrices(quaternions: Array) -> Array:
    """Of unit quaternions w, x, y, z, shape (N, 4)."""
    return np.asarray(Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix())


class RigidRobot:
    """A robot with logarithmic ropes; state: position, velocity, rotation, body rates, unstrained lengths."""

    def __init__(self, robot: Robot, start_tensions: Array) -> None:
        assert robot.platform.inertia is not None
        self.robot, self.start_tensions = robot, start_tensions
        self.inertia, self.centre = np.array(robot.platform.inertia), np.array(robot.platform.centre_of_mass)
        self.attachments, self.anchors = np.array(robot.attachments), np.array(robot.anchors)
        self.axial = np.array([cable.modulus * cable.area for cable in robot.cables])
        self.damping = np.array([cable.damping * cable.area for cable in robot.cables])

    def start(self, orientation: Array) -> Array:
        rotation = rotation_matrices(np.array([orientation]))[0]
        position = np.array(self.robot.platform.start)
        spans = self.anchors - position - self.attachments @ rotation.T
        return np.array([*position, *[0.0] * 3, *rotation.ravel(), *[0.0] * 3, *np.linalg.norm(spans, axis=1)])

    def ropes(self, state: Array, speed: Array) -> tuple[Array, Array, Array]:
        """Tensions, unit vectors and lengths."""
        rotation = state[6:15].reshape(3, 3)
        arms = self.attachments @ rotation.T
        spans = self.anchors - state[:3] - arms
        lengths = np.linalg.norm(spans, axis=1)
        units = spans / lengths[:, None]
        rates = -np.sum(units * (state[3:6] + np.cross(rotation @ state[15:18], arms)), axis=1)
        strain = np.log(lengths / state[18:])
        pull = self.axial * strain + self.damping * (rates + speed) / lengths + self.start_tensions
        return np.maximum(pull, 0.0), units, lengths

    def rates(self, state: Array, speed: Array) -> Array:
        tensions, units, lengths = self.ropes(state, speed)
        platform, rotation, turning = self.robot.platform, state[6:15].reshape(3, 3), state[15:18]
        forces = tensions[:, None] * units
        moment = np.cross(self.attachments - self.centre, forces @ rotation).sum(axis=0)
        turning_rate = np.linalg.solve(self.inertia, moment - np.cross(turning, self.inertia @ turning))
        acceleration = forces.sum(axis=0) / platform.mass - [0.0, 0.0, self.robot.gravity]
        to_centre = np.cross(turning_rate, self.centre) + np.cross(turning, np.cross(turning, self.centre))
        spin = np.cross(np.eye(3), turning)
        return np.concatenate(
            [
                state[3:6],
                acceleration - rotation @ to_centre,
                (rotation @ spin).ravel(),
                turning_rate,
                -speed * state[18:] / lengths,
            ]
        )

    def energy(self, motion: RigidMotion, lengths: Array) -> tuple[Array, Array]:
        """Kinetic and total energy in J, with undamped ropes while the winches stand."""
        platform = self.robot.platform
        arms = motion.rotation @ self.centre
        velocity = motion.velocity + np.cross(motion.angular_velocity, arms)
        turning = np.einsum("nji,nj->ni", motion.rotation, motion.angular_velocity)
        kinetic = 0.5 * platform.mass * np.sum(velocity**2, axis=1)
        kinetic += 0.5 * np.einsum("ni,ij,nj->n", turning, self.inertia, turning)
        weight = platform.mass * self.robot.gravity * (motion.position + arms)[:, 2]
        elastic = np.sum(motion.tension * lengths - self.axial * lengths, axis=1)
        return kinetic, kinetic + weight + elastic


def integrated(robot: Robot, start: tuple[Array, Array], time: Array, speeds: Array) -> RigidMotion:
    """Motion over winch speeds (N, n) that are linear between ``time``; ``start``: orientation and tensions."""
    system = RigidRobot(robot, start[1])
    states = [system.start(start[0])]
    for begin, end, first, last in zip(time, time[1:], speeds, speeds[1:], strict=False):
        slope = (last - first) / (end - begin)
        states.append(
            solve_ivp(
                lambda t, y, begin=begin, first=first, slope=slope: system.rates(y, first + slope * (t - begin)),
                (begin, end),
                states[-1],
                method="DOP853",
                rtol=1e-12,
                atol=1e-13,
            ).y[:, -1]
        )
    rows = np.array(states)
    rotation = rows[:, 6:15].reshape(-1, 3, 3)
    tension = np.array([system.ropes(row, speed)[0] for row, speed in zip(rows, speeds, strict=True)])
    turning = np.einsum("nij,nj->ni", rotation, rows[:, 15:18])
    return RigidMotion(rows[:, :3], rows[:, 3:6], rotation, turning, tension)
