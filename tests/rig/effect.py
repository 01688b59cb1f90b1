"""What an effect may change, stage by stage, in one evaluation of the rig."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from tests.rig.robot import Robot, Vector

if TYPE_CHECKING:
    from tests.rig.mechanics import Rig


def torque_of(arms: Vector, forces: Vector) -> Vector:
    """Sum of the moments of forces at the ends of arms, by rows."""
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = (arms.T @ forces).tolist()
    return np.array([yz - zy, zx - xz, xy - yx])


class Moment:
    """All that the rig knows at one instant; the stages fill it from top to bottom. One row per cable."""

    time: float
    displacement: Vector  # of the platform from its start, m
    position: Vector
    velocity: Vector
    wound: Vector  # rope taken in: integral of V/l (logarithmic) or of V (linear)
    state: Vector  # the whole state, of which each effect owns the slice `effect.part`
    rates: Vector  # its time derivative
    rotation: Vector  # of a platform that turns: matrix from its axes to the world's
    turning: Vector  # its angular velocity, rad/s
    arms: Vector  # from the origin of the platform's frame to each attachment, m; zero for a point mass
    centre: Vector  # to its centre of mass
    ends: Vector  # of the ropes at the platform, m
    end_velocity: Vector
    exits: Vector  # where the ropes leave the frame, m
    exit_velocity: Vector
    speed: Vector  # rope speed at the exit, positive reels in, m/s
    travel: Vector  # what the drum encoder counted since the start, m
    direction: Vector  # unit vectors from the platform along the ropes
    chord: Vector  # straight distance, m
    length: Vector  # of the rope from exit point to platform, m
    rate: Vector  # dl/dt, m/s
    strain: Vector  # since the start
    free_rate: Vector  # rate of strain that carries no stress (creep, heat), 1/s
    strain_rate: Vector  # (dl/dt + V)/l - free_rate
    tension: Vector  # in the free span, N
    pull: Vector  # on the platform, N
    cell: Vector  # at the load cell, N
    force: Vector  # on the platform, N
    torque: Vector  # about the origin of its frame, N m
    acceleration: Vector  # of that origin

    def push(self, force: Vector, arm: Vector) -> None:
        """Add a force at the end of an arm, or forces at the ends of as many (rows)."""
        self.force = self.force + (force if force.ndim == 1 else force.sum(axis=0))
        if arm.any():
            self.torque = self.torque + torque_of(np.atleast_2d(arm), np.atleast_2d(force))


@dataclass(kw_only=True)
class Effect:
    """One physical effect; a subclass overrides the stages that it takes part in."""

    kinked: ClassVar[bool] = False  # whether slopes jump at instants that nobody knows beforehand
    of_points: ClassVar[bool] = False  # whether a platform that turns cannot have it
    of_bodies: ClassVar[bool] = False  # whether a point mass cannot

    cables: Sequence[int] | None = None  # counted from 1; None means all

    def attach(self, rig: Rig) -> None:
        """Note the rig and which cables are meant; called once, before statics."""
        if (self.of_points and rig.robot.body) or (self.of_bodies and not rig.robot.body):
            raise ValueError(f"{type(self).__name__} is not for this kind of platform")
        self.rig = rig
        self.on: NDArray[np.bool_] = np.zeros(rig.robot.count, bool)
        self.on[:] = self.cables is None
        if self.cables is not None:
            self.on[np.array(self.cables, int) - 1] = True
        self.mask = self.on.astype(float)
        self.part = slice(0, 0)

    def declare(self, robot: Robot) -> Robot:
        """The robot with other constants."""
        return robot

    def size(self) -> int:
        """How many states of its own the effect has."""
        return 0

    def settle(self) -> None:
        """Note what statics found; called once, after statics."""

    def begin(self) -> Vector:
        """Its states at the start; statics are known by then."""
        return np.zeros(self.size())

    def resting(self) -> Vector:
        """Force on the resting platform that no `load` gives, N."""
        return np.zeros(3)

    def exits(self, moment: Moment) -> None:
        """Move the exit points."""

    def geometry(self, moment: Moment) -> None:
        """Give other rope lengths and directions."""

    def strains(self, moment: Moment) -> None:
        """Change the strain at given length."""

    def stiffness(self, moment: Moment) -> None:
        """Change the tension at given strain."""

    def winding(self, moment: Moment) -> None:
        """Change the rope speed that the winch gives."""

    def viscous(self, moment: Moment) -> None:
        """Change the tension at given strain rate."""

    def transmit(self, moment: Moment) -> None:
        """Make pull on the platform or load cell differ from the tension of the span."""

    def load(self, moment: Moment) -> None:
        """Put a further force on the platform: `force` at the origin of its frame, or by `push`."""

    def couple(self, moment: Moment) -> None:
        """Hang a further body on the platform, once all forces are known."""

    def delay(self) -> dict[str, Vector]:
        """By how many seconds outputs lag: keys `position` (3) and `tension` (n)."""
        return {}

    def sense(self, tension: Vector, position: Vector) -> tuple[Vector, Vector]:
        """What the sensors give for true outputs, one row per sample."""
        return tension, position


STAGES = (
    "exits",
    "geometry",
    "strains",
    "stiffness",
    "winding",
    "viscous",
    "transmit",
    "load",
    "couple",
)
