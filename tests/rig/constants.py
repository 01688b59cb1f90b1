"""Effects that only change a constant of the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Robot


@dataclass(kw_only=True)
class Damping(Effect):
    """The cable's total viscosity c in T = E S eps + c S deps/dt + T0, Pa s.

    With another exponent p than 1, what it has more than the declared viscosity c_0 acts as
    (c - c_0) S r sign(deps/dt) |deps/dt / r|^p, r `reference` in 1/s.
    """

    damping: float
    exponent: float = 1.0
    reference: float = 1e-3

    def declare(self, robot: Robot) -> Robot:
        """Put it in the place of the declared one."""
        self.declared = robot.damping
        if self.exponent != 1.0:
            return robot
        return replace(robot, damping=np.where(self.on, self.damping, robot.damping))

    def viscous(self, moment: Moment) -> None:
        """Add what is not linear."""
        if self.exponent != 1.0:
            more = self.mask * (self.damping - self.declared) * self.rig.robot.area * self.reference
            power = np.abs(moment.strain_rate / self.reference) ** self.exponent
            moment.tension = moment.tension + more * np.sign(moment.strain_rate) * power


@dataclass(kw_only=True)
class Modulus(Effect):
    """The cable's total modulus of elasticity E in T = E S eps + T0, Pa."""

    modulus: float

    def declare(self, robot: Robot) -> Robot:
        """Put it in the place of the declared one."""
        return replace(robot, modulus=np.where(self.on, self.modulus, robot.modulus))


@dataclass(kw_only=True)
class Payload(Effect):
    """Mass carried in addition to the declared platform, kg; statics include it."""

    mass: float

    def declare(self, robot: Robot) -> Robot:
        """Add it to the platform."""
        return replace(robot, mass=robot.mass + self.mass)
