"""The wrench-feasible workspace: where the cables, which only pull, can hold the platform."""

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
from ..process_signals import defer_interrupts
from .active_effects import cables_have_weight, platform_effects
from .cable_routes import cable_routes
from .schema import Robot, TensionLimits, require_point_mass
from .static_equilibrium import static_tensions
from .static_load import cable_weight_force, static_load
from .tension_distribution import DEFAULT_LIMITS

Array = NDArray[np.float64]

DEFAULT_INTERVALS = 20
MAX_POINTS = 1_000_000
PARALLEL_TOLERANCE = 1e-9
# Relative to the required force: smaller margins are zero up to rounding.
ZERO_MARGIN_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Workspace:
    """The wrench-feasible workspace on a grid of positions.

    ``axes`` are the coordinates of the grid along x, y and z in m, N_x, N_y and N_z of them; all else has the shape
    (N_x, N_y, N_z). ``margin`` in N: the smallest force, in the worst direction, that on top of the required ones
    exceeds what the cables can exert; negative where they cannot exert the required ones, by the shortfall.
    ``min_tension`` and ``max_tension`` are of the static tensions, in N. NaN: tensions without equilibrium, and all at
    an exit point.
    """

    axes: tuple[Array, Array, Array]
    margin: Array
    min_tension: Array
    max_tension: Array

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Where the cables can exert the required forces."""
        return self.margin >= 0.0

    def frame(self) -> pd.DataFrame:
        """One row per position: x, y, z, feasible (0 or 1), margin, lowest_tension, highest_tension."""
        coordinates = np.meshgrid(*self.axes, indexing="ij")
        columns = [*coordinates, self.feasible.astype(int), self.margin, self.min_tension, self.max_tension]
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
    """Computes the wrench-feasible workspace on a grid that contains the robot's start.

    ``lower`` and ``upper`` are corners of a box in m, by default about all exit points and the start; ``spacing`` in
    m, by default a twentieth of its longest side. Required are the weight and every acceleration whose components are
    at most ``acceleration``, in m/s^2. The tensions keep within the limits of the robot file where there are more
    than three cables; else they are only not negative. ``progress`` receives the completed fraction.

    The forces that the cables can exert are ``{U T : T_min <= T_i <= T_max}``, a polytope with faces normal to every
    ``n = u_i x u_j``. The margin is the minimum of ``h(n) - n . w`` over faces and required forces w, with
    ``h(n) = sum_k max(T_min n . u_k, T_max n . u_k)``.

    Raises InputError for an invalid box, spacing or acceleration.

    Source: Bouchard, Gosselin and Moore (2010), Journal of Mechanisms and Robotics 2(1), 011013.
    """
    if not (np.isfinite(acceleration) and acceleration >= 0.0):
        raise InputError("acceleration", f"{acceleration:g} m/s2 is negative or not finite", "give zero or more")
    require_point_mass(robot.name, robot)
    axes = _grid(robot, lower, upper, spacing)
    shape = tuple(len(axis) for axis in axes)
    margin, min_tension, max_tension = (np.full(shape, np.nan) for _ in range(3))
    with defer_interrupts() as raise_interrupt:
        for count, index in enumerate(np.ndindex(*shape)):
            raise_interrupt()
            if progress is not None:
                progress(count / margin.size)
            position = np.array([axis[k] for axis, k in zip(axes, index, strict=True)])
            margin[index], min_tension[index], max_tension[index] = _evaluate_position(robot, position, acceleration)
    return Workspace(axes, margin, min_tension, max_tension)


def _evaluate_position(robot: Robot, position: Array, acceleration: float) -> tuple[float, float, float]:
    """Margin, lowest and highest static tension at a position in m, all in N; NaN as in :class:`Workspace`."""
    margin = np.nan
    try:
        margin = wrench_margin(robot, position, acceleration)
        tensions = static_tensions(robot, position)
    except UnreachableError:
        return margin, np.nan, np.nan
    return margin, float(np.min(tensions)), float(np.max(tensions))


def wrench_margin(robot: Robot, position: Array, acceleration: float = 0.0) -> float:
    """The margin of :class:`Workspace` at a position in m, in N.

    Raises UnreachableError where a cable has no length there.
    """
    require_point_mass(robot.name, robot)
    routes = cable_routes(REAL, robot, position.tolist())
    direction_matrix = np.array([route.direction for route in routes]).T
    load_vector = np.array(static_load(REAL, robot, position.tolist()))
    if cables_have_weight(robot):
        load_vector = load_vector - np.array(
            cable_weight_force(REAL, robot, routes, [float(np.linalg.norm(load_vector))] * len(routes))
        )
    constants = PointMassConstants(robot.platform.mass, robot.gravity)
    mass = float(total_mass(REAL, constants, platform_effects(robot)))
    signs = np.array(list(product((-1.0, 1.0), repeat=3)) if acceleration else [(0.0, 0.0, 0.0)])
    limits = (robot.tension or DEFAULT_LIMITS) if robot.cable_count > 3 else DEFAULT_LIMITS
    return _polytope_margin(direction_matrix, limits, load_vector + mass * acceleration * signs)


def _polytope_margin(direction_matrix: Array, limits: TensionLimits, required: Array) -> float:
    normals = _face_normals(direction_matrix)
    projections = normals @ direction_matrix
    # Infinity times zero is not zero: a cable in the plane of a face does not contribute.
    extreme_tensions = np.where(
        projections > PARALLEL_TOLERANCE,
        limits.maximum,
        np.where(projections < -PARALLEL_TOLERANCE, limits.minimum, 0.0),
    )
    support = np.sum(np.where(extreme_tensions == 0.0, 0.0, extreme_tensions) * projections, axis=1)
    margins = support[:, None] - normals @ required.T
    margins[np.abs(margins) < ZERO_MARGIN_TOLERANCE * np.max(np.abs(required), initial=1.0)] = 0.0
    return float(np.min(margins))


def _face_normals(direction_matrix: Array) -> Array:
    """Unit normals of all faces, in both directions; of all planes through the cables if they are collinear."""
    cross_products = np.array(
        [
            np.cross(direction_matrix[:, i], direction_matrix[:, j])
            for i, j in combinations(range(direction_matrix.shape[1]), 2)
        ]
    )
    sizes = np.linalg.norm(cross_products, axis=1)
    normals = cross_products[sizes > PARALLEL_TOLERANCE] / sizes[sizes > PARALLEL_TOLERANCE, None]
    if not len(normals):
        normals = np.linalg.svd(direction_matrix)[0][:, 1:].T
    return np.vstack([normals, -normals])


def _grid(
    robot: Robot, lower: Sequence[float] | None, upper: Sequence[float] | None, spacing: float | None
) -> tuple[Array, Array, Array]:
    start = np.array(robot.platform.start)
    points = np.vstack([robot.anchors, start])
    lower_corner = np.min(points, axis=0) if lower is None else np.asarray(lower, dtype=float)
    upper_corner = np.max(points, axis=0) if upper is None else np.asarray(upper, dtype=float)
    if (
        lower_corner.shape != (3,)
        or upper_corner.shape != (3,)
        or not np.all(np.isfinite([lower_corner, upper_corner]))
        or np.any(lower_corner > upper_corner)
    ):
        corners = f"{lower_corner.tolist()} to {upper_corner.tolist()}"
        raise InputError("box", f"{corners} is none", "give three finite coordinates in m each, the lower ones first")
    longest = float(np.max(upper_corner - lower_corner))
    step = longest / DEFAULT_INTERVALS if spacing is None else spacing
    if not (np.isfinite(step) and step > 0.0):
        raise InputError("spacing", f"{step:g} m is not positive", "give a distance in m")
    axes = [_grid_axis(a, b, s, step) for a, b, s in zip(lower_corner, upper_corner, start, strict=True)]
    count = int(np.prod([len(axis) for axis in axes], dtype=float))
    if count > MAX_POINTS:
        raise InputError("spacing", f"{step:g} m makes {count} points, more than {MAX_POINTS}", "give a larger one")
    return axes[0], axes[1], axes[2]


def _grid_axis(lower: float, upper: float, start: float, step: float) -> Array:
    """Grid points from ``lower`` to ``upper``, one of them at the start if it lies between."""
    base = start if lower <= start <= upper else lower
    rounding = 1e-9
    below, above = int((base - lower) / step + rounding), int((upper - base) / step + rounding)
    points: Array = base + step * np.arange(-below, above + 1, dtype=float)
    return points
