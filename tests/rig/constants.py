"""Effects that only change a constant of the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.rig.effect import Effect
from tests.rig.robot import Robot


@dataclass(kw_only=True)
class Damping(Effect):
    """The cable's total viscosity c in T = E S eps + c S deps/dt + T0, Pa s."""

    damping: float

    def declare(self, robot: Robot) -> Robot:
        """Put it in the place of the declared one."""
        return replace(robot, damping=np.where(self.on, self.damping, robot.damping))


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
