"""A winch whose speed loop is a PI controller on an inertia, in terms of the motor, with limits of rope speed.

The controller is written as most textbooks do, with the integral of the error and back-calculation:

    J dw/dt = torque,   torque = limited(Kp e + I),   dI/dt = Ki e + (torque - Kp e - I) Ki / Kp,   e = w_wanted - w

The motor gives no more torque than what holds the rope's acceleration within its limit, and no more than Kp times what
is left to the limit of speed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from tests.rig.robot import Vector


@dataclass(frozen=True)
class Drive:
    """A motor of 1 kg m^2 on a gear and a drum; radius in m, bandwidth in Hz, limits of the rope in m/s and m/s^2."""

    radius: float = 0.1
    gear: float = 1.0
    bandwidth: float = 10.0
    damping_ratio: float = 1.0
    speed_limit: float = np.inf
    acceleration_limit: float = np.inf

    @property
    def turn(self) -> float:
        """Angle of the motor for one metre of rope, rad/m."""
        return self.gear / self.radius

    def torque(self, command: float, state: Vector) -> tuple[float, float]:
        """What the motor gives and what the controller asks for, N m; the state is (motor speed, integral)."""
        proportional = 4.0 * np.pi * self.bandwidth * self.damping_ratio
        wanted = np.clip(command, -self.speed_limit, self.speed_limit) * self.turn
        top, most = self.speed_limit * self.turn, self.acceleration_limit * self.turn
        asked = proportional * (wanted - state[0]) + state[1]
        upper = np.minimum(most, proportional * (top - state[0]))
        lower = np.maximum(-most, -proportional * (top + state[0]))
        return float(np.clip(asked, lower, upper)), float(asked)

    def run(self, command: Callable[[float], float], times: Vector, corners: Sequence[float] = ()) -> Vector:
        """Rope speed (m/s), acceleration (m/s^2) and travel (m) at rising times, from rest at 0; shape (N, 3).

        Integration restarts at the corners of the command, and takes steps too short to miss a limit.
        """
        proportional = 4.0 * np.pi * self.bandwidth * self.damping_ratio
        integral = (2.0 * np.pi * self.bandwidth) ** 2

        def rates(time: float, state: Vector) -> list[float]:
            given, asked = self.torque(command(time), state)
            error = np.clip(command(time), -self.speed_limit, self.speed_limit) * self.turn - state[0]
            back = (given - asked) * integral / proportional
            return [given, integral * error + back, state[0] / self.turn]

        state, rows = np.zeros(3), np.zeros((len(times), 3))
        bounds = sorted({0.0, float(times[-1]), *(c for c in corners if 0.0 < c < times[-1])})
        for left, right in pairwise(bounds):
            wanted = np.flatnonzero((times > left) & (times <= right))
            instants = np.append(times[wanted], right)
            solution = solve_ivp(
                rates,
                (left, right),
                state,
                method="DOP853",
                t_eval=np.unique(instants),
                rtol=1e-12,
                atol=1e-13,
                max_step=0.02 / self.bandwidth,
            )
            state = solution.y[:, -1]
            rows[wanted] = solution.y.T[: len(wanted)]
        results = [
            (r[0] / self.turn, self.torque(command(t), r)[0] / self.turn, r[2])
            for t, r in zip(times, rows, strict=True)
        ]
        return np.array(results)
