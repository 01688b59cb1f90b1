"""Effects that only change a constant of the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.optimize import linear_sum_assignment

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
    """Mass carried in addition to the declared platform, kg; statics include it.

    On a platform that turns it is a point at x, y, z (m, in its axes) from the centre of mass.
    """

    mass: float
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    def declare(self, robot: Robot) -> Robot:
        """Add it to the platform."""
        body = robot.body
        if body is not None:
            point = (self.mass, np.array([self.x, self.y, self.z]))
            body = replace(body, points=(*body.points, point))
        return replace(robot, mass=robot.mass + self.mass, body=body)


@dataclass(kw_only=True)
class CentreOfMass(Effect):
    """A centre of mass that is elsewhere than declared, by x, y, z in m; the inertia is that about it."""

    of_bodies: ClassVar[bool] = True

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    def declare(self, robot: Robot) -> Robot:
        """Move it."""
        assert robot.body is not None
        return replace(robot, body=replace(robot.body, centre=np.add(robot.body.centre, [self.x, self.y, self.z])))


@dataclass(kw_only=True)
class Attachment(Effect):
    """Cables that hold the platform elsewhere than declared, by x, y, z in m."""

    of_bodies: ClassVar[bool] = True

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    def declare(self, robot: Robot) -> Robot:
        """Move the attachments."""
        assert robot.body is not None
        moved = robot.body.attachments + np.outer(self.mask, [self.x, self.y, self.z])
        return replace(robot, body=replace(robot.body, attachments=moved))


@dataclass(kw_only=True)
class Inertia(Effect):
    """Principal moments other than declared, by factors; each axis has the factor of the coordinate nearest to it."""

    of_bodies: ClassVar[bool] = True

    factor_x: float = 1.0
    factor_y: float = 1.0
    factor_z: float = 1.0

    def declare(self, robot: Robot) -> Robot:
        """Scale the moments."""
        assert robot.body is not None
        moments, axes = np.linalg.eigh(robot.body.inertia)
        _, order = linear_sum_assignment(-np.abs(axes.T))
        factors = np.array([self.factor_x, self.factor_y, self.factor_z])[order]
        return replace(robot, body=replace(robot.body, inertia=(axes * (moments * factors)) @ axes.T))
