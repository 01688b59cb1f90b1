"""LQG with integral action: a Kalman filter of the plant, and feedback of its state.

    a_k = -K (x_k, w_k, z_k),                 x the estimate from samples before t_k: one sample of delay
    x_k+1 = F x_k + G (w_k, a_k) + L (y_k - C x_k - D w_k),           z_k+1 = z_k + (pose error)_k

All signals are deviations from the path: ``y`` of pose and tensions, ``w`` of winch speeds; ``a`` are the winch
accelerations over the next sample. The pose of a rigid platform has rotations behind its position, in rad about the
axes of the world; on fewer than six cables only the position is integrated, as statics decides the orientation, and
in a plane only its coordinates there. Motion across the plane of all cables is no part of the plant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant, linearise
from ..robot.schema import Robot, validate_robot
from ..validation import validate_instance
from .design import ControlAim, Knot, measurement_noise, pose_signals, regulator_signals, require_taut
from .reachable_plant import integrated_coordinates, reach_notes, reachable_plant, require_reachable, twist_states
from .sampled_plant import sampled_plant
from .stability_margins import margin_notes

Array = NDArray[np.float64]

# python-control would use slycot if installed, and the last digits would differ.
RICCATI_METHOD = "scipy"


@dataclass(frozen=True)
class Controller:
    """A designed LQG controller; n cables, p states of the plant, d degrees of freedom, of which z are integrated.

    ``linear`` is the linearised plant, what winches reach of it, see :mod:`tautwire.control.reachable_plant`.
    ``plant`` is the sampled ``control.StateSpace`` from winch accelerations to pose, tensions and winch speeds, with
    states (plant, winch speeds). ``feedback`` (n, p + n + z) is K, ``observer`` (p, d + n) is L.
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
    def uses_feedback(self) -> bool:
        """See :class:`tautwire.control.Design`."""
        return True

    @property
    def regulator(self) -> Any:
        """The controller without limits as a ``control.StateSpace`` from outputs of ``plant`` to its inputs.

        Signals are deviations from the path; the sign of the feedback is included, so close the loop with
        ``control.feedback(plant, regulator, 1)``. States are the estimate and the summed pose errors.
        """
        count, (size, sensors) = self.cable_count, self.observer.shape
        signals = regulator_signals(count, sensors - count)
        correction = self.observer @ self.plant.C[:-count]
        A, B = self.plant.A[:size] - correction, self.plant.B[:size]
        K_state, K_speed, K_sum = np.hsplit(self.feedback, [size, size + count])
        integrated, coordinates = K_sum.shape[1], integrated_coordinates(self.linear)
        sums = np.eye(sensors + count)[coordinates]
        return control.ss(
            np.block([[A[:, :size] - B @ K_state, -B @ K_sum], [np.zeros((integrated, size)), np.eye(integrated)]]),
            np.vstack([np.hstack([self.observer, A[:, size:] - B @ K_speed]), sums]),
            -np.hstack([K_state, K_sum]),
            -np.hstack([np.zeros((count, sensors)), K_speed]),
            self.aim.period,
            states=[*self.plant.state_labels[:size], *(f"{signals['inputs'][i]}_error_sum" for i in coordinates)],
            **signals,
        )

    @property
    def tracking(self) -> Array:
        """Anti-windup gain, (p + z, n): the observer uses the limited acceleration, the integrals are corrected by it.

        Back-calculation: the integrals approach those that would have commanded the limited acceleration, over
        ``integral_time``. Source: Astrom and Hagglund (2006), Advanced PID Control, section 3.5, back-calculation.
        """
        size = len(self.observer)
        of_sums = self.feedback[:, size + self.cable_count :]
        sum_correction = self.aim.period / self.aim.integral_time * np.linalg.pinv(of_sums)
        return np.vstack([self.plant.B[:size], -sum_correction])

    @property
    def notes(self) -> tuple[str, ...]:
        """Modes that winches hardly reach, and small disk margins, one line each; takes up to some seconds."""
        return (*reach_notes(self.linear), *margin_notes((self.linear,), self.knots()))

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`tautwire.control.Design`; one for the whole path."""
        return (Knot(0.0, self.regulator, self.tracking),)


def design_controller(
    robot: Robot,
    aim: ControlAim | None = None,
    at: Sequence[float] | None = None,
    orientation: Sequence[float] | None = None,
) -> Controller:
    """Designs LQG with integral action on the plant linearised at ``at``, three coordinates in m, by default the start.

    ``a_k = -K (x_k, w_k, z_k)``: winch accelerations (n,) in m/s^2 from the estimate of a Kalman filter, winch speeds
    and summed errors of the pose, sampled at ``aim.period``. ``aim`` holds weights and limits. The ``orientation`` of a
    rigid platform is a unit quaternion, by default that of the robot file. ``notes`` of the design tell which modes the
    winches hardly reach, and where its disk margin is below 0.1.

    Raises UnreachableError where the cables cannot hold the platform there, OperatingPointError where they do not hold
    it stably, InputError where winches do not reach a mode that does not decay, or sensors do not show it,
    ArgumentError for an invalid argument. Source: Franklin, Powell and Workman (1998), Digital
    Control of Dynamic Systems, chapter 9.
    """
    validate_robot("design_controller: robot", robot)
    aim = (
        ControlAim()
        if aim is None
        else validate_instance("design_controller: aim", aim, ControlAim, "give a ControlAim")
    )
    linear = reachable_plant(linearise(robot, at, orientation=orientation))
    require_taut(robot, linear)
    require_reachable(robot.name, linear)
    plant = sampled_plant(linear, aim.period)
    return Controller(aim, linear, plant, _feedback_gain(aim, linear, plant), _kalman_gain(robot, aim, linear, plant))


def _feedback_gain(aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """LQI gain: weighs pose, tensions, winch speeds and summed errors of the pose against winch accelerations."""
    count, freedoms = len(linear.tensions), linear.degrees_of_freedom
    integrated = integrated_coordinates(linear)
    tension = aim.tension * float(np.mean(linear.tensions))
    scales = np.repeat([aim.position, aim.rotation, tension, aim.winch_speed], [3, freedoms - 3, count, count])
    scaled = plant.C / scales[:, None]
    weights = scaled.T @ scaled
    weights = 0.5 * (weights + weights.T)  # python-control wants it symmetric to the last bit
    sums = np.diag((aim.period / (aim.integral_time * scales[integrated])) ** 2)
    zeros = np.zeros((len(weights), len(integrated)))
    gain, _, _ = control.dlqr(
        plant,
        np.block([[weights, zeros], [zeros.T, sums]]),
        np.eye(count) / aim.winch_acceleration**2,
        integral_action=plant.C[integrated],
        method=RICCATI_METHOD,
    )
    return np.asarray(gain)


def _kalman_gain(robot: Robot, aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """Stationary Kalman gain: random walks of velocity, rope and effects as process noise, and sensor noise."""
    count, size, freedoms = len(linear.tensions), linear.system.nstates, linear.degrees_of_freedom
    labels, twist = linear.system.state_labels, twist_states(freedoms)
    noise = dict.fromkeys(twist[:3], aim.acceleration_disturbance)
    noise |= dict.fromkeys(twist[3:], aim.angular_acceleration_disturbance)
    wandering = [index for index, label in enumerate(labels) if label not in pose_signals(freedoms)]
    process_noise = np.array([noise.get(labels[index], aim.speed_disturbance) for index in wandering])
    gain, _, _ = control.dlqe(
        plant.A[:size, :size],
        np.eye(size)[:, wandering],
        plant.C[:-count, :size],
        np.diag(process_noise**2 * aim.period),
        np.diag(measurement_noise(robot, positive=True) ** 2),
        method=RICCATI_METHOD,
    )
    return np.asarray(gain)
