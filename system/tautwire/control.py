"""A sampled LQG controller with integral action that holds the platform on a path.

At each sample it reads positions and tensions; the winches then run on a ramp from their speed to the next one:

    V(t_k+1) = V_ideal(t_k+1) + w_k+1,        w_k+1 = w_k + h a_k
    a_k = -K (x_k, w_k, z_k),                 x the estimate from samples before t_k: one sample for computing
    x_k+1 = F x_k + G (w_k, a_k) + L (y_k - C x_k - D w_k),           z_k+1 = z_k + (position error)_k

All in deviations from the path: ``y`` from its positions and tensions, ``w`` from the ideal winch speeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, total_mass

from .cosimulation import AXES, STEP, Motion, run
from .errors import UnreachableError
from .linear import LinearPlant, linearise
from .master import FixedStep, Progress
from .packaging import RobotFmus
from .robot import Robot
from .statics import platform_effects, static_tensions
from .trajectory import Trajectory, cable_directions, ideal_winch_speeds

Array = NDArray[np.float64]

# What a robot file that declares no sensors is taken to have.
POSITION_NOISE = 1e-4
TENSION_NOISE = 1.0


@dataclass(frozen=True)
class ControlAim:
    """What the controller weighs; each number is the size of a deviation that costs as much as the others.

    ``period`` in s; ``position`` in m; ``tension`` as a share of the mean static tension; ``winch_speed`` in
    m/s and ``winch_acceleration`` in m/s^2, beyond the ideal ones; ``integral_time`` in s, over which a
    lasting error of position grows that important. ``speed_limit``, in m/s, bounds what is asked of any winch.

    The observer expects velocity to wander by ``acceleration_disturbance`` (m/s^2) and rope by
    ``speed_disturbance`` (m/s) within a second. A larger ``speed_disturbance`` makes the loop more robust
    against a wrong modulus or payload, a smaller one calmer under noise (loop transfer recovery).
    """

    period: float = 0.01
    position: float = 1e-3
    tension: float = 0.1
    winch_speed: float = 0.1
    winch_acceleration: float = 0.5
    integral_time: float = 0.25
    speed_limit: float = 3.0
    acceleration_disturbance: float = 0.2
    speed_disturbance: float = 0.01


@dataclass(frozen=True)
class Controller:
    """A designed controller; n cables, p states of the plant.

    ``plant`` is the sampled ``control.StateSpace`` from winch accelerations to position, tensions and winch
    speeds, with states (plant, winch speeds). ``feedback`` (n, p + n + 3) is K, ``observer`` (p, 3 + n) is L.
    """

    aim: ControlAim
    linear: LinearPlant
    plant: Any
    feedback: Array
    observer: Array

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        return len(self.feedback)

    @property
    def regulator(self) -> Any:
        """The unlimited controller as a ``control.StateSpace``: outputs of ``plant`` in, its inputs out.

        Signals are deviations from the path; the sign of the feedback is inside, so close the loop with
        ``control.feedback(plant, regulator, 1)``. States are the estimate and the summed position errors.
        """
        count, size = self.cable_count, len(self.observer)
        measured = self.observer @ self.plant.C[:-count]
        A, B = self.plant.A[:size] - measured, self.plant.B[:size]
        K_state, K_speed, K_sum = np.hsplit(self.feedback, [size, size + count])
        sums = np.eye(3, 3 + 2 * count)
        return control.ss(
            np.block([[A[:, :size] - B @ K_state, -B @ K_sum], [np.zeros((3, size)), np.eye(3)]]),
            np.vstack([np.hstack([self.observer, A[:, size:] - B @ K_speed]), sums]),
            -np.hstack([K_state, K_sum]),
            -np.hstack([np.zeros((count, 3 + count)), K_speed]),
            self.aim.period,
            inputs=self.plant.output_labels,
            outputs=self.plant.input_labels,
            states=[*self.plant.state_labels[:size], *(f"position_error_sum_{axis}" for axis in AXES)],
            name="regulator",
        )


def design_controller(robot: Robot, aim: ControlAim | None = None, at: Sequence[float] | None = None) -> Controller:
    """LQG with integral action on the plant linearised at ``at`` (m), by default the start.

    Raises what :func:`tautwire.linear.linearise` raises.
    """
    aim = aim or ControlAim()
    linear = linearise(robot, at)
    plant = control.sample_system(_with_winches(linear), aim.period, method="zoh", name="sampled_plant")
    return Controller(aim, linear, plant, _feedback(aim, linear, plant), _observer(robot, aim, linear, plant))


def _with_winches(linear: LinearPlant) -> Any:
    """The plant with winches whose speed is a state: inputs held over a sample are then ramps of speed."""
    system, count = linear.system, len(linear.tensions)
    seen = [*range(3), *range(6, 6 + count)]
    winches = list(system.input_labels[:count])
    still, each = np.zeros((count, system.nstates)), np.eye(count)
    return control.ss(
        np.block([[system.A, system.B[:, :count]], [still, np.zeros_like(each)]]),
        np.vstack([still.T, each]),
        np.block([[system.C[seen], system.D[seen, :count]], [still, each]]),
        0.0,
        states=[*system.state_labels, *winches],
        inputs=[f"winch_acceleration_{index}" for index in range(1, count + 1)],
        outputs=[*(system.output_labels[place] for place in seen), *winches],
    )


def _feedback(aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """LQI: positions, tensions, winch speeds and summed position errors against winch accelerations."""
    count = len(linear.tensions)
    tension = aim.tension * float(np.mean(linear.tensions))
    sizes = np.repeat([aim.position, tension, aim.winch_speed], [3, count, count])
    scaled = plant.C / sizes[:, None]
    weights = scaled.T @ scaled
    weights = 0.5 * (weights + weights.T)  # python-control wants it symmetric to the last bit
    sums = np.eye(3) * (aim.period / (aim.integral_time * aim.position)) ** 2
    nothing = np.zeros((len(weights), 3))
    gain, _, _ = control.dlqr(
        plant,
        np.block([[weights, nothing], [nothing.T, sums]]),
        np.eye(count) / aim.winch_acceleration**2,
        integral_action=plant.C[:3],
    )
    return np.asarray(gain)


def _observer(robot: Robot, aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """The stationary Kalman gain: random walks of velocity, rope and effects against the sensors' noise."""
    count, size = len(linear.tensions), linear.system.nstates
    walk = np.repeat([aim.acceleration_disturbance, aim.speed_disturbance], [3, size - 6])
    gain, _, _ = control.dlqe(
        plant.A[:size, :size],
        np.eye(size)[:, 3:],
        plant.C[:-count, :size],
        np.diag(walk**2 * aim.period),
        np.diag(measurement_noise(robot) ** 2),
    )
    return np.asarray(gain)


def measurement_noise(robot: Robot) -> Array:
    """Standard deviation of one sample of x, y, z (m) and the tensions (N), shape (3 + n,)."""
    position, tension = robot.sensors.position_noise, robot.sensors.tension_noise
    return np.repeat([position or POSITION_NOISE, tension or TENSION_NOISE], [3, robot.cable_count])


def path_tensions(robot: Robot, trajectory: Trajectory, times: Array) -> Array:
    """Tensions that carry the platform along a path, shape (N, n), in N.

    ``T = T_0 + U^+ (m (g e_z + a) - U T_0)``: of all that move it, those nearest to the start's.

    Raises UnreachableError where a cable would have to push.
    """
    start = static_tensions(robot)
    positions = trajectory.position(times)
    unit = cable_directions(robot, positions)
    declared = PointMassConstants(robot.platform.mass, robot.gravity)
    mass = total_mass(REAL, declared, platform_effects(robot))
    load = mass * (trajectory.acceleration(times) + np.array([0.0, 0.0, robot.gravity]))
    change = np.linalg.pinv(unit) @ (load - unit @ start)[:, :, None]
    tensions: Array = start + change[:, :, 0]
    if np.min(tensions) < 0.0:
        moment, cable = np.unravel_index(np.argmin(tensions), tensions.shape)
        raise UnreachableError(
            robot.name,
            position=tuple(positions[moment]),
            cable=int(cable) + 1,
            tension=float(tensions[moment, cable]),
            mend=f"choose a slower path, or one that the cables can hold (it fails at {times[moment]:g} s)",
        )
    return tensions


class PathController:
    """A controller at work on one path: a source of winch speeds for the master, at the controller's samples.

    ``seed`` switches measurement noise on. ``speeds`` (N, n) are the winch speeds at the samples so far.
    """

    def __init__(
        self, robot: Robot, controller: Controller, trajectory: Trajectory, times: Array, seed: int | None = None
    ) -> None:
        self.controller = controller
        self.ideal = ideal_winch_speeds(robot, trajectory, times)
        self.expected = np.hstack([trajectory.position(times), path_tensions(robot, trajectory, times)])
        self.noise = np.zeros_like(self.expected)
        if seed is not None:
            drawn = np.random.default_rng(seed).standard_normal(self.expected.shape)
            self.noise = drawn * measurement_noise(robot)
        self.times = times
        self.estimate = np.zeros(len(controller.observer))
        self.sums = np.zeros(3)
        limit = controller.aim.speed_limit
        self._speeds = [np.clip(self.ideal[0], -limit, limit)]
        self.acceleration = np.zeros(controller.cable_count)

    @property
    def speeds(self) -> Array:
        """Winch speeds at the samples passed and at the end of the present one, in m/s."""
        return np.array(self._speeds)

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.master.Source`; samples are the times that the controller was given."""
        if step > 0.0 and index == len(self._speeds) - 1:
            self._sample(index, shown)
        start = self._speeds[index] + (time - self.times[index]) * self.acceleration
        return (
            np.column_stack([start, self.acceleration]).ravel(),
            np.column_stack([start + step * self.acceleration, self.acceleration]).ravel(),
        )

    def _sample(self, index: int, shown: Array) -> None:
        design, count = self.controller, self.controller.cable_count
        period, limit = design.aim.period, design.aim.speed_limit
        deviation = self._speeds[index] - self.ideal[index]
        wanted = -design.feedback @ np.concatenate([self.estimate, deviation, self.sums])
        free = self.ideal[index + 1] + deviation + period * wanted
        speed = np.clip(free, -limit, limit)
        self.acceleration = (speed - self._speeds[index]) / period
        self._speeds.append(speed)
        measured = np.concatenate([shown[:3], shown[6 : 6 + count]]) + self.noise[index]
        error = measured - self.expected[index]
        known = np.concatenate([self.estimate, deviation])
        applied = (speed - self.ideal[index + 1] - deviation) / period
        moved = (design.plant.A @ known + design.plant.B @ applied)[: len(self.estimate)]
        self.estimate = moved + design.observer @ (error - design.plant.C[:-count] @ known)
        # A winch at its limit cannot mend the error; summing on would only wind up.
        if np.array_equal(speed, free):
            self.sums = self.sums + error[:3]


def cosimulate_closed_loop(
    fmus: RobotFmus,
    robot: Robot,
    controller: Controller,
    trajectory: Trajectory,
    duration: float,
    step: float = STEP,
    seed: int | None = None,
    progress: Progress | None = None,
) -> Motion:
    """Co-simulate the FMUs with the controller over whole samples until ``duration`` (s) is reached.

    ``robot`` is what the controller believes; ``step`` bounds the macro step in s; ``seed`` switches the noise of
    the robot's sensors on. Returns the run at the controller's samples.

    Raises UnreachableError where the path asks a cable to push.
    """
    period = controller.aim.period
    count = int(np.ceil(duration / period * (1.0 - 1e-9))) + 1
    times = np.linspace(0.0, (count - 1) * period, count)
    source = PathController(robot, controller, trajectory, times, seed)
    return run(fmus, source, times, FixedStep(step), progress)
