"""Gain scheduling: a controller designed at several points of a path, with interpolated gains.

All designs must estimate the same quantities. Then the transfer is bumpless: the state is continuous, and continuous
gains give continuous accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..linear import LinearPlant
from ..robot.pose_trajectory import turns
from ..robot.schema import Robot
from ..robot.trajectory import Trajectory
from .design import ControlAim, Design, Knot
from .lqg import design_controller
from .reachable_plant import integrated_coordinates, reach_notes
from .stability_margins import margin_notes

Array = NDArray[np.float64]
DesignPose = tuple[Sequence[float], Sequence[float] | None]

DESIGN_POINTS = 9


class DesignOfOnePlant(Design, Protocol):
    """Interface of a design at one operating point."""

    @property
    def linear(self) -> LinearPlant:
        """The plant that it is designed on."""
        ...


@dataclass(frozen=True)
class ScheduledController:
    """Controllers of one kind for ``times`` (s), rising, along a path.

    Raises InputError where they do not have the same states, which could not be interpolated.
    """

    times: tuple[float, ...]
    controllers: tuple[DesignOfOnePlant, ...]

    def __post_init__(self) -> None:
        structures = [(list(plant.system.state_labels), integrated_coordinates(plant)) for plant in self.plants]
        for time, structure in zip(self.times, structures, strict=True):
            if structure != structures[0]:
                problem = f"reach other states or coordinates at {time:g} s than at {self.times[0]:g} s"
                raise InputError("ScheduledController: winches", problem, "schedule over a part of the path")

    @property
    def aim(self) -> ControlAim:
        """See :class:`tautwire.control.Design`."""
        return self.controllers[0].aim

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        return self.controllers[0].cable_count

    @property
    def uses_feedback(self) -> bool:
        """See :class:`tautwire.control.Design`."""
        return True

    @property
    def plants(self) -> tuple[LinearPlant, ...]:
        """The plants that it is designed on."""
        return tuple(controller.linear for controller in self.controllers)

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of each point, see :attr:`tautwire.control.Controller.notes`; takes up to some seconds for each."""
        hardly_reached = (note for plant in self.plants for note in reach_notes(plant))
        return (*hardly_reached, *margin_notes(self.plants, self.knots()))

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`tautwire.control.Design`."""
        return tuple(
            replace(controller.knots()[0], time=time)
            for time, controller in zip(self.times, self.controllers, strict=True)
        )


def design_poses(trajectory: Trajectory, times: Array) -> list[DesignPose]:
    """Positions of a path at times, with its orientations where it has some."""
    positions = trajectory.position(times).tolist()
    orientations = trajectory.orientation(times).tolist() if turns(trajectory) else [None] * len(times)
    return list(zip(positions, orientations, strict=True))


def schedule_controller(
    robot: Robot, trajectory: Trajectory, aim: ControlAim | None = None, points: int = DESIGN_POINTS
) -> ScheduledController:
    """Gain-scheduled LQG designs at ``points`` equidistant times of a path, from its start to its end.

    Raises what :func:`tautwire.linear.linearise` raises.
    """
    times = np.linspace(0.0, trajectory.duration, points)
    controllers = [design_controller(robot, aim, *pose) for pose in design_poses(trajectory, times)]
    return ScheduledController(tuple(times.tolist()), tuple(controllers))
