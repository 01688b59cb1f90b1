"""LQG with integral action: a Kalman filter of the plant, and feedback of its state.

    a_k = -K (x_k, w_k, z_k),                 x the estimate from samples before t_k: one sample of delay
    x_k+1 = F x_k + G (w_k, a_k) + L (y_k - C x_k - D w_k),           z_k+1 = z_k + (position error)_k

All signals are deviations from the path: ``y`` of positions and tensions, ``w`` of winch speeds; ``a`` are the winch
accelerations over the next sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant, linearise
from ..robot.schema import AXES, Robot, validate_point_mass_robot
from ..validation import validate_instance
from .design import ControlAim, Knot, measurement_noise, regulator_signals
from .sampled_plant import sampled_plant

Array = NDArray[np.float64]

# python-control would use slycot if installed, and the last digits would differ.
RICCATI_METHOD = "scipy"


@dataclass(frozen=True)
class Controller:
    """A designed LQG controller; n cables, p states of the plant.

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
    def uses_feedback(self) -> bool:
        """See :class:`tautwire.control.Design`."""
        return True

    @property
    def regulator(self) -> Any:
        """The controller without limits as a ``control.StateSpace`` from outputs of ``plant`` to its inputs.

        Signals are deviations from the path; the sign of the feedback is included, so close the loop with
        ``control.feedback(plant, regulator, 1)``. States are the estimate and the summed position errors.
        """
        count, size = self.cable_count, len(self.observer)
        correction = self.observer @ self.plant.C[:-count]
        A, B = self.plant.A[:size] - correction, self.plant.B[:size]
        K_state, K_speed, K_sum = np.hsplit(self.feedback, [size, size + count])
        sums = np.eye(3, 3 + 2 * count)
        return control.ss(
            np.block([[A[:, :size] - B @ K_state, -B @ K_sum], [np.zeros((3, size)), np.eye(3)]]),
            np.vstack([np.hstack([self.observer, A[:, size:] - B @ K_speed]), sums]),
            -np.hstack([K_state, K_sum]),
            -np.hstack([np.zeros((count, 3 + count)), K_speed]),
            self.aim.period,
            states=[*self.plant.state_labels[:size], *(f"position_error_sum_{axis}" for axis in AXES)],
            **regulator_signals(count),
        )

    @property
    def tracking(self) -> Array:
        """Anti-windup gain, (p + 3, n): the observer uses the limited acceleration, the integrals are corrected by it.

        Back-calculation: the integrals approach those that would have commanded the limited acceleration, over
        ``integral_time``. Source: Astrom and Hagglund (2006), Advanced PID Control, section 3.5, back-calculation.
        """
        size = len(self.observer)
        sum_correction = self.aim.period / self.aim.integral_time * np.linalg.pinv(self.feedback[:, -3:])
        return np.vstack([self.plant.B[:size], -sum_correction])

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`tautwire.control.Design`; one for the whole path."""
        return (Knot(0.0, self.regulator, self.tracking),)


def design_controller(robot: Robot, aim: ControlAim | None = None, at: Sequence[float] | None = None) -> Controller:
    """Designs LQG with integral action on the plant linearised at ``at``, three coordinates in m, by default the start.

    ``a_k = -K (x_k, w_k, z_k)``: winch accelerations (n,) in m/s^2 from the estimate of a Kalman filter, winch speeds
    and summed position errors, sampled at ``aim.period``. ``aim`` holds weights and limits.

    Raises UnreachableError where the cables cannot hold the platform there, OperatingPointError where they do not hold
    it stably, ArgumentError for an invalid argument. Source: Franklin, Powell and Workman (1998), Digital
    Control of Dynamic Systems, chapter 9.
    """
    validate_point_mass_robot("design_controller: robot", robot)
    aim = (
        ControlAim()
        if aim is None
        else validate_instance("design_controller: aim", aim, ControlAim, "give a ControlAim")
    )
    linear = linearise(robot, at)
    plant = sampled_plant(linear, aim.period)
    return Controller(aim, linear, plant, _feedback_gain(aim, linear, plant), _kalman_gain(robot, aim, linear, plant))


def _feedback_gain(aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """LQI gain: weighs positions, tensions, winch speeds and summed position errors against winch accelerations."""
    count = len(linear.tensions)
    tension = aim.tension * float(np.mean(linear.tensions))
    scales = np.repeat([aim.position, tension, aim.winch_speed], [3, count, count])
    scaled = plant.C / scales[:, None]
    weights = scaled.T @ scaled
    weights = 0.5 * (weights + weights.T)  # python-control wants it symmetric to the last bit
    sums = np.eye(3) * (aim.period / (aim.integral_time * aim.position)) ** 2
    zeros = np.zeros((len(weights), 3))
    gain, _, _ = control.dlqr(
        plant,
        np.block([[weights, zeros], [zeros.T, sums]]),
        np.eye(count) / aim.winch_acceleration**2,
        integral_action=plant.C[:3],
        method=RICCATI_METHOD,
    )
    return np.asarray(gain)


def _kalman_gain(robot: Robot, aim: ControlAim, linear: LinearPlant, plant: Any) -> Array:
    """Stationary Kalman gain: random walks of velocity, rope and effects as process noise, and sensor noise."""
    count, size = len(linear.tensions), linear.system.nstates
    process_noise = np.repeat([aim.acceleration_disturbance, aim.speed_disturbance], [3, size - 6])
    gain, _, _ = control.dlqe(
        plant.A[:size, :size],
        np.eye(size)[:, 3:],
        plant.C[:-count, :size],
        np.diag(process_noise**2 * aim.period),
        np.diag(measurement_noise(robot) ** 2),
        method=RICCATI_METHOD,
    )
    return np.asarray(gain)
