"""A controller that is designed at several places of a path, with its gains interpolated in between.

All designs must estimate the same quantities. Then nothing jumps where one takes over from another: the state goes
on, and gains that change continuously ask for accelerations that do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..linear import LinearPlant
from ..robots.robot import Robot
from ..trajectory import Trajectory
from .aim import ControlAim
from .design import Design, Knot
from .lqg import design_controller

PLACES = 9


class DesignOfOnePlant(Design, Protocol):
    """A design for one place."""

    @property
    def linear(self) -> LinearPlant:
        """The plant that it is designed on."""
        ...


@dataclass(frozen=True)
class ScheduledController:
    """Controllers of one kind for ``times`` (s), rising, along a path."""

    times: tuple[float, ...]
    controllers: tuple[DesignOfOnePlant, ...]

    @property
    def aim(self) -> ControlAim:
        """See :class:`tautwire.control.Design`."""
        return self.controllers[0].aim

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        return self.controllers[0].cable_count

    @property
    def feels(self) -> bool:
        """See :class:`tautwire.control.Design`."""
        return True

    @property
    def plants(self) -> tuple[LinearPlant, ...]:
        """The plants that it is designed on."""
        return tuple(controller.linear for controller in self.controllers)

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`tautwire.control.Design`."""
        return tuple(
            replace(controller.knots()[0], time=time)
            for time, controller in zip(self.times, self.controllers, strict=True)
        )


def schedule_controller(
    robot: Robot, trajectory: Trajectory, aim: ControlAim | None = None, places: int = PLACES
) -> ScheduledController:
    """LQG designs at equally many times of a path, from its start to its end.

    Raises what :func:`tautwire.linear.linearise` raises.
    """
    times = np.linspace(0.0, trajectory.duration, places)
    controllers = [design_controller(robot, aim, at) for at in trajectory.position(times).tolist()]
    return ScheduledController(tuple(times.tolist()), tuple(controllers))
