"""Workspaces: at which poses the cables, which only pull, can hold the platform."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..errors import InputError, UnreachableError
from ..name_suggestions import suggest_name
from ..process_signals import defer_interrupts
from .cable_interference import cables_interfere, platform_interferes
from .pose_grid import Axes, PoseGrid, PositionGrid, position_grid
from .schema import Quaternion, Robot
from .static_equilibrium import tensions_at
from .workspace_criteria import CRITERIA, RequiredMotion, degrees_of_freedom, wrench_feasible_margin

Array = NDArray[np.float64]

AT_REST = RequiredMotion()


@dataclass(frozen=True)
class Workspace:
    """A workspace on a grid of poses, by one of the criteria of :data:`tautwire.robot.workspace_criteria.CRITERIA`.

    ``axes`` are the coordinates of the grid, N_x, N_y and N_z of them, by their ``axis_names`` (m, or rad); all else
    has the shape (N_x, N_y, N_z). ``margin`` in N: of the wrench-feasible workspace the smallest wrench, in the worst
    direction, that on top of the required ones exceeds what the cables can exert; negative where they cannot exert the
    required ones, by the shortfall. ``min_tension`` and ``max_tension`` are of the static tensions, in N. All are those
    of the worst orientation. NaN: tensions without equilibrium, the margin without wrench closure, all at an exit
    point. ``interference`` tells of a rigid platform where cables touch each other, and where one runs through the
    platform.
    """

    axes: Axes
    margin: Array
    min_tension: Array
    max_tension: Array
    axis_names: tuple[str, str, str] = ("x", "y", "z")
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    criterion: str = "wrench-feasible"
    interference: tuple[NDArray[np.bool_], NDArray[np.bool_]] | None = None

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Which points of the grid belong to the workspace, interference aside."""
        return self.margin >= 0.0

    def frame(self) -> pd.DataFrame:
        """One row per point: x, y, z or the rotations, feasible (0 or 1), margin, lowest_tension, highest_tension.

        Of a rigid platform also cables_interfere and platform_interferes (0 or 1).
        """
        coordinates = np.meshgrid(*self.axes, indexing="ij")
        columns = [*coordinates, self.feasible.astype(int), self.margin, self.min_tension, self.max_tension]
        names = [*self.axis_names, "feasible", "margin", "lowest_tension", "highest_tension"]
        if self.interference is not None:
            columns += [each.astype(int) for each in self.interference]
            names += ["cables_interfere", "platform_interferes"]
        return pd.DataFrame({name: values.ravel() for name, values in zip(names, columns, strict=True)})


def wrench_feasible_workspace(
    robot: Robot,
    lower: Sequence[float] | None = None,
    upper: Sequence[float] | None = None,
    spacing: float | None = None,
    acceleration: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Workspace:
    """The wrench-feasible workspace on a grid of positions, at the declared orientation; see :func:`workspace_on`.

    ``lower``, ``upper`` and ``spacing`` as of :func:`tautwire.robot.pose_grid.position_grid`. Required are the weight
    and every acceleration whose components are at most ``acceleration``, in m/s^2. The tensions keep within the limits
    of the robot file where there are more cables than degrees of freedom; else they are only not negative.

    Raises InputError for an invalid box, spacing or acceleration.
    """
    motion = RequiredMotion(acceleration)
    return workspace_on(position_grid(robot, lower, upper, spacing), robot, motion=motion, progress=progress)


def workspace_on(
    grid: PoseGrid,
    robot: Robot,
    criterion: str = "wrench-feasible",
    motion: RequiredMotion = AT_REST,
    progress: Callable[[float], None] | None = None,
) -> Workspace:
    """The workspace on a grid of poses, by a ``criterion`` of :data:`tautwire.robot.workspace_criteria.CRITERIA`.

    ``wrench-feasible``: tensions within bounds exert the weight's wrench and those of the required ``motion``;
    ``wrench-closure``: tensions without an upper bound exert every wrench; ``static``: static equilibrium within
    bounds, of fewer than six cables in an orientation near that of the grid. ``progress`` receives the completed
    fraction.

    Raises InputError for another criterion, or one that so few cables never meet.
    """
    _require_criterion(robot, grid, criterion)
    shape = tuple(len(axis) for axis in grid.axes)
    margin, min_tension, max_tension = (np.full(shape, np.nan) for _ in range(3))
    cables_touch, platform_touches = (np.zeros(shape, dtype=np.bool_) for _ in range(2))
    with defer_interrupts() as raise_interrupt:
        for count, index in enumerate(np.ndindex(*shape)):
            raise_interrupt()
            if progress is not None:
                progress(count / margin.size)
            coordinates = np.array([axis[k] for axis, k in zip(grid.axes, index, strict=True)])
            position, orientations = grid.poses(coordinates)
            poses = [(position, orientation) for orientation in orientations]
            margin[index], min_tension[index], max_tension[index] = np.array(
                [_evaluate_pose(robot, *pose, criterion, motion) for pose in poses]
            ).min(axis=0) * (1.0, 1.0, -1.0)
            if robot.platform.is_rigid_body:
                cables_touch[index] = any(_interferes(cables_interfere, robot, *pose) for pose in poses)
                platform_touches[index] = any(_interferes(platform_interferes, robot, *pose) for pose in poses)
    interference = (cables_touch, platform_touches) if robot.platform.is_rigid_body else None
    return Workspace(grid.axes, margin, min_tension, max_tension, grid.axis_names, grid.centre, criterion, interference)


def wrench_margin(robot: Robot, position: Array, acceleration: float = 0.0) -> float:
    """The margin of :func:`wrench_feasible_workspace` at a position in m, in N.

    Raises UnreachableError where a cable has no length there.
    """
    _require_enough_cables(robot, "wrench-feasible")
    return wrench_feasible_margin(robot, position, robot.platform.start_orientation, RequiredMotion(acceleration))


def _require_criterion(robot: Robot, grid: PoseGrid, criterion: str) -> None:
    if criterion not in CRITERIA:
        raise InputError("criterion", f"{criterion!r} is none", f"write {suggest_name(criterion, tuple(CRITERIA))}")
    if criterion != "static":
        _require_enough_cables(robot, criterion)
    if criterion == "wrench-closure" and robot.cable_count == degrees_of_freedom(robot):
        problem = f"{robot.cable_count} cables, which only pull, never exert every wrench"
        raise InputError(robot.name, problem, "compute the wrench-feasible or the static workspace")
    is_turned = not isinstance(grid, PositionGrid) or len(grid.orientations) > 1
    if is_turned and robot.cable_count < degrees_of_freedom(robot):
        problem = f"{robot.cable_count} cables leave no orientation to choose"
        raise InputError(robot.name, problem, "compute the static workspace without a range of rotations")


def _require_enough_cables(robot: Robot, criterion: str) -> None:
    if robot.cable_count < degrees_of_freedom(robot):
        part = "moment" if robot.platform.is_rigid_body else "force"
        problem = f"{robot.cable_count} cables cannot exert a {part} of every direction: no pose is {criterion}"
        raise InputError(robot.name, problem, "compute the static workspace, with --criterion static")


def _evaluate_pose(
    robot: Robot, position: Array, orientation: Quaternion, criterion: str, motion: RequiredMotion
) -> tuple[float, float, float]:
    """Margin, lowest and negative highest static tension at a pose, in N; NaN as in :class:`Workspace`."""
    margin = np.nan
    try:
        margin = CRITERIA[criterion](robot, position, orientation, motion)
        tensions = tensions_at(robot, position, orientation)
    except UnreachableError:
        return margin, np.nan, np.nan
    return margin, float(np.min(tensions)), -float(np.max(tensions))


def _interferes(
    test: Callable[[Robot, Array, Quaternion], bool], robot: Robot, position: Array, orientation: Quaternion
) -> bool:
    try:
        return test(robot, position, orientation)
    except UnreachableError:
        return False
