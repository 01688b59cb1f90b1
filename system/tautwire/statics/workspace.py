"""Where a robot's cables, which only pull, can hold its platform: the wrench-feasible workspace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, total_mass

from ..errors import InputError, UnreachableError
from ..interrupt import interrupts_held
from ..robots.robot import Robot, TensionLimits
from .equilibrium import DEFAULT_LIMITS, has_weight, hung, load, platform_effects, routes, static_tensions

Array = NDArray[np.float64]

INTERVALS = 20
MOST_POINTS = 1_000_000
PARALLEL = 1e-9
# Relative to what is required: below it a margin is zero but for rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Workspace:
    """A grid of positions, and what the cables can do there.

    ``axes`` are the coordinates of the grid along x, y and z in m, N_x, N_y and N_z of them; all else has the shape
    (N_x, N_y, N_z). ``margin`` in N: the least force, in the worst direction, that on top of what is required is too
    much for the cables; negative where they do not hold what is required, then what is missing. ``lowest`` and
    ``highest`` are the static tensions in N. Not numbers: tensions where statics has none, and all at an exit point.
    """

    axes: tuple[Array, Array, Array]
    margin: Array
    lowest: Array
    highest: Array

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Where the cables hold what is required."""
        return self.margin >= 0.0

    def frame(self) -> pd.DataFrame:
        """One row a position: x, y, z, feasible (0 or 1), margin, lowest_tension, highest_tension."""
        places = np.meshgrid(*self.axes, indexing="ij")
        columns = [*places, self.feasible.astype(int), self.margin, self.lowest, self.highest]
        names = ("x", "y", "z", "feasible", "margin", "lowest_tension", "highest_tension")
        return pd.DataFrame({name: values.ravel() for name, values in zip(names, columns, strict=True)})


def wrench_feasible_workspace(
    robot: Robot,
    lower: Sequence[float] | None = None,
    upper: Sequence[float] | None = None,
    spacing: float | None = None,
    acceleration: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Workspace:
    """The wrench-feasible workspace on a grid that has the robot's start among its points.

    ``lower`` and ``upper`` are corners of a box in m, by default about all exit points and the start; ``spacing`` in
    m, by default a twentieth of its longest side. Required are the weight and every acceleration whose components are
    at most ``acceleration``, in m/s^2. The tensions keep within the limits of the robot file where there are more
    than three cables; else they are only not negative. ``progress`` gets the share that is done.

    All forces that the cables can make are ``{U T : T_min <= T_i <= T_max}``, a polytope with faces normal to every
    ``n = u_i x u_j``. The margin is the least of ``h(n) - n . w`` over faces and required forces w, with
    ``h(n) = sum_k max(T_min n . u_k, T_max n . u_k)``.

    Raises InputError where box, spacing or acceleration are none.

    Source: Bouchard, Gosselin and Moore (2010), Journal of Mechanisms and Robotics 2(1), 011013.
    """
    if not (np.isfinite(acceleration) and acceleration >= 0.0):
        raise InputError("acceleration", f"{acceleration:g} m/s2 is negative or not finite", "give zero or more")
    axes = _grid(robot, lower, upper, spacing)
    shape = tuple(len(axis) for axis in axes)
    margin, lowest, highest = (np.full(shape, np.nan) for _ in range(3))
    with interrupts_held() as raise_interrupt:
        for count, place in enumerate(np.ndindex(*shape)):
            raise_interrupt()
            if progress is not None:
                progress(count / margin.size)
            position = np.array([axis[k] for axis, k in zip(axes, place, strict=True)])
            try:
                margin[place] = wrench_margin(robot, position, acceleration)
                tensions = static_tensions(robot, position)
            except UnreachableError:
                continue
            lowest[place], highest[place] = np.min(tensions), np.max(tensions)
    return Workspace(axes, margin, lowest, highest)


def wrench_margin(robot: Robot, position: Array, acceleration: float = 0.0) -> float:
    """The margin of :class:`Workspace` at a position in m, in N.

    Raises UnreachableError where a cable has no length there.
    """
    lines = routes(REAL, robot, position.tolist())
    unit = np.array([line.direction for line in lines]).T
    held = np.array(load(REAL, robot, position.tolist()))
    if has_weight(robot):
        held = held - np.array(hung(REAL, robot, lines, [float(np.linalg.norm(held))] * len(lines)))
    constants = PointMassConstants(robot.platform.mass, robot.gravity)
    mass = float(total_mass(REAL, constants, platform_effects(robot)))
    signs = np.array(list(product((-1.0, 1.0), repeat=3)) if acceleration else [(0.0, 0.0, 0.0)])
    limits = (robot.tension or DEFAULT_LIMITS) if robot.cable_count > 3 else DEFAULT_LIMITS
    return _margin(unit, limits, held + mass * acceleration * signs)


def _margin(unit: Array, limits: TensionLimits, required: Array) -> float:
    normals = _normals(unit)
    along = normals @ unit
    # Infinity times zero is not zero: a cable in the plane of a face adds nothing to it.
    strongest = np.where(along > PARALLEL, limits.maximum, np.where(along < -PARALLEL, limits.minimum, 0.0))
    reach = np.sum(np.where(strongest == 0.0, 0.0, strongest) * along, axis=1)
    margins = reach[:, None] - normals @ required.T
    margins[np.abs(margins) < ROUNDING * np.max(np.abs(required), initial=1.0)] = 0.0
    return float(np.min(margins))


def _normals(unit: Array) -> Array:
    """Unit normals of all faces, both ways; of all planes through the cable where all lie on one line."""
    pairs = np.array([np.cross(unit[:, i], unit[:, j]) for i, j in combinations(range(unit.shape[1]), 2)])
    sizes = np.linalg.norm(pairs, axis=1)
    normals = pairs[sizes > PARALLEL] / sizes[sizes > PARALLEL, None]
    if not len(normals):
        normals = np.linalg.svd(unit)[0][:, 1:].T
    return np.vstack([normals, -normals])


def _grid(
    robot: Robot, lower: Sequence[float] | None, upper: Sequence[float] | None, spacing: float | None
) -> tuple[Array, Array, Array]:
    start = np.array(robot.platform.start)
    known = np.vstack([robot.anchors, start])
    least = np.min(known, axis=0) if lower is None else np.asarray(lower, dtype=float)
    most = np.max(known, axis=0) if upper is None else np.asarray(upper, dtype=float)
    if least.shape != (3,) or most.shape != (3,) or not np.all(np.isfinite([least, most])) or np.any(least > most):
        corners = f"{least.tolist()} to {most.tolist()}"
        raise InputError("box", f"{corners} is none", "give three finite coordinates in m each, the lower ones first")
    longest = float(np.max(most - least))
    step = longest / INTERVALS if spacing is None else spacing
    if not (np.isfinite(step) and step > 0.0):
        raise InputError("spacing", f"{step:g} m is not positive", "give a distance in m")
    axes = [_through(a, b, s, step) for a, b, s in zip(least, most, start, strict=True)]
    count = int(np.prod([len(axis) for axis in axes], dtype=float))
    if count > MOST_POINTS:
        raise InputError("spacing", f"{step:g} m makes {count} points, more than {MOST_POINTS}", "give a larger one")
    return axes[0], axes[1], axes[2]


def _through(least: float, most: float, start: float, step: float) -> Array:
    """Points from ``least`` to ``most``, one of them at the start if that is between."""
    base = start if least <= start <= most else least
    slack = 1e-9
    below, above = int((base - least) / step + slack), int((most - base) / step + slack)
    points: Array = base + step * np.arange(-below, above + 1, dtype=float)
    return points
