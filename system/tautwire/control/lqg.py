"""LQG with integral action: a Kalman filter of the plant, and feedback of its state.

    a_k = -K (x_k, w_k, z_k),                 x the estimate from samples before t_k: one sample of delay
    x_k+1 = F x_k + G (w_k, a_k) + L (y_k - C x_k - D w_k),           z_k+1 = z_k + (pose error)_k

All signals are deviations from the path: ``y`` of pose and tensions, ``w`` of winch speeds; ``a`` are the winch
accelerations over the next sample. The pose of a rigid platform has rotations behind its position, in rad about the
axes of the world; on fewer than six cables only the position is integrated, as statics decides the orientation.
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
from .design import ControlAim, Knot, integrated_freedoms, measurement_noise, regulator_signals, require_taut
from .sampled_plant import sampled_plant

Array = NDArray[np.float64]

# python-control would use slycot if installed, and the last digits would differ.
RICCATI_METHOD = "scipy"


@dataclass(frozen=True)
class Controller:
    """A designed LQG controller; n cables, p states of the plant, d degrees of freedom, of which z are integrated.

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
        integrated = K_sum.shape[1]
        sums = np.eye(integrated, sensors + count)
        return control.ss(
            np.block([[A[:, :size] - B @ K_state, -B @ K_sum], [np.zeros((integrated, size)), np.eye(integrated)]]),
            np.vstack([np.hstack([self.observer, A[:, size:] - B @ K_speed]), sums]),
            -np.hstack([K_state, K_sum]),
            -np.hstack([np.zeros((count, sensors)), K_speed]),
            self.aim.period,
            states=[*self.plant.state_labels[:size], *(f"{name}_error_sum" for name in signals["inputs"][:integrated])],
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
    rigid platform is a unit quaternion, by default that of the robot file.

    Raises UnreachableError where the cables cannot hold the platform there, OperatingPointError where they do not hold
    it stably, ArgumentError for an invalid argument. Source: Franklin, Powell and Workman (1998), Digital
    Control of Dynamic Systems, chapter 9.
    """
    validate_robot("design_controller: robot", robot)
    aim = (
        ControlAim()
        if aim is None
        else validate_instance("design_controller: aim", aim, ControlAim, "give a ControlAim")
    )
    linear = linearise(robot, at, orientation=orientation)
    require_taut(robot, linear)
    plant = sampled_plant(linear, aim.period)
    return Controller(aim, linear, plant, _feedback_gain(aim, linear, plant), _kalman_gain(robot, aim, linear, plant))


def _feedback_gain(aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """LQI gain: weighs pose, tensions, winch speeds and summed errors of the pose against winch accelerations."""
    count, freedoms = len(linear.tensions), linear.degrees_of_freedom
    integrated = integrated_freedoms(count, freedoms)
    tension = aim.tension * float(np.mean(linear.tensions))
    scales = np.repeat([aim.position, aim.rotation, tension, aim.winch_speed], [3, freedoms - 3, count, count])
    scaled = plant.C / scales[:, None]
    weights = scaled.T @ scaled
    weights = 0.5 * (weights + weights.T)  # python-control wants it symmetric to the last bit
    sums = np.diag((aim.period / (aim.integral_time * scales[:integrated])) ** 2)
    zeros = np.zeros((len(weights), integrated))
    gain, _, _ = control.dlqr(
        plant,
        np.block([[weights, zeros], [zeros.T, sums]]),
        np.eye(count) / aim.winch_acceleration**2,
        integral_action=plant.C[:integrated],
        method=RICCATI_METHOD,
    )
    return np.asarray(gain)


def _kalman_gain(robot: Robot, aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """Stationary Kalman gain: random walks of velocity, rope and effects as process noise, and sensor noise."""
    count, size, freedoms = len(linear.tensions), linear.system.nstates, linear.degrees_of_freedom
    process_noise = np.repeat(
        [aim.acceleration_disturbance, aim.angular_acceleration_disturbance, aim.speed_disturbance],
        [3, freedoms - 3, size - 2 * freedoms],
    )
    gain, _, _ = control.dlqe(
        plant.A[:size, :size],
        np.eye(size)[:, freedoms:],
        plant.C[:-count, :size],
        np.diag(process_noise**2 * aim.period),
        np.diag(measurement_noise(robot, positive=True) ** 2),
        method=RICCATI_METHOD,
    )
    return np.asarray(gain)
