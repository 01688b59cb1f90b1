"""Interference of cables at a pose: with each other, and with the platform, the convex hull of its attachments."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rotation import rotate

from .active_effects import attachments
from .cable_routes import attachment_points, cable_routes
from .schema import Quaternion, Robot

Array = NDArray[np.float64]

# Relative to the cables' length, and of 1 for directions: nearer than this is rounding.
TOUCH_TOLERANCE = 1e-9


def cables_interfere(robot: Robot, position: Array, orientation: Quaternion) -> bool:
    """Whether two straight cables come nearer to each other than the sum of their radii, by their declared areas.

    Cables that share an exit point or an attachment meet there by design and do not count.

    Raises UnreachableError where a cable has no length.
    """
    starts, ends = _cable_segments(robot, position, orientation)
    anchors = np.array(robot.anchors)
    radii = np.sqrt(np.array([cable.area for cable in robot.cables]) / np.pi)
    scale = TOUCH_TOLERANCE * float(np.max(np.linalg.norm(ends - starts, axis=1)))
    for first, second in combinations(range(robot.cable_count), 2):
        nearest_ends = min(float(np.linalg.norm(points[first] - points[second])) for points in (starts, anchors))
        allowed = max(scale, float(radii[first] + radii[second]))
        distance = segment_distance(starts[first], ends[first], starts[second], ends[second])
        if distance < allowed < nearest_ends:
            return True
    return False


def platform_interferes(robot: Robot, position: Array, orientation: Quaternion) -> bool:
    """Whether a cable runs through the platform, whose body is the convex hull of its attachments.

    A cable that begins on the hull enters it if it points inwards from all faces that it begins on. A platform with all
    attachments in one plane has no inside.

    Raises UnreachableError where a cable has no length.
    """
    points: Array = np.array(attachments(robot))
    try:
        # Each face as its outward normal n and offset d, n . x + d <= 0 inside.
        faces = ConvexHull(points).equations
    except (QhullError, ValueError):
        return False
    scale = TOUCH_TOLERANCE * float(np.ptp(points))
    w, x, y, z = orientation
    routes = cable_routes(REAL, robot, position.tolist(), orientation)
    for attachment, route in zip(points, routes, strict=True):
        direction = np.array(rotate((w, -x, -y, -z), route.direction))
        touched = np.abs(faces[:, :3] @ attachment + faces[:, 3]) <= scale
        if np.all(faces[touched, :3] @ direction < -TOUCH_TOLERANCE):
            return True
    return False


def segment_distance(start: Array, end: Array, other_start: Array, other_end: Array) -> float:
    """Smallest distance between two straight segments, in m.

    Source: Ericson (2005), Real-Time Collision Detection, section 5.1.9.
    """
    along, other_along, between = end - start, other_end - other_start, start - other_start
    a, b, c = along @ along, along @ other_along, other_along @ other_along
    d, e = along @ between, other_along @ between
    determinant = a * c - b * b
    # Parallel segments have many nearest pairs, one of them at an end.
    share = float(np.clip((b * e - c * d) / determinant, 0.0, 1.0)) if determinant > 1e-12 * a * c else 0.0
    other_share = float(b * share + e) / float(c)
    if not 0.0 <= other_share <= 1.0:
        other_share = float(np.clip(other_share, 0.0, 1.0))
        share = float(np.clip((b * other_share - d) / a, 0.0, 1.0))
    return float(np.linalg.norm(between + share * along - other_share * other_along))


def _cable_segments(robot: Robot, position: Array, orientation: Quaternion) -> tuple[Array, Array]:
    """Ends of the free cables, at the platform and where they leave their exit points, each (n, 3) in m."""
    routes = cable_routes(REAL, robot, position.tolist(), orientation)
    starts = np.array(attachment_points(robot, position.tolist(), orientation), dtype=float)
    directions = np.array([route.direction for route in routes], dtype=float)
    chords = np.array([route.chord for route in routes], dtype=float)
    return starts, starts + chords[:, None] * directions
