"""Studies beyond the paper: the laws against a rope on a drum, the relaxing rope, and a redundant robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..control.feedforward import elastic_reference
from ..materials import RobotMaterial, with_material
from ..robots.robot import Cable, Robot, TensionLimits
from ..trajectory import Helix
from .drum import QuasiStaticMotion, follow_path
from .helix import TENSION_LAWS
from .parameters import PaperParameters, with_law, with_rope
from .ramps import SAMPLE_COUNTS as RAMP_SAMPLES
from .ramps import dynamic_rope
from .records import Records, SimulationCase, SimulationRecord, path_case, ramp_case

Array = NDArray[np.float64]

# Widths of the frame in m; the three-cable robot's is 100 m.
FRAME_WIDTHS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
COSIMULATED_WIDTHS = (1.0, 10.0, 100.0, 500.0)
PAPER_FRAME_WIDTH = 100.0
QUASI_STATIC_SAMPLES, HELIX_SAMPLES = 400, 500
# The redundant robot: a box about the helix, its lower exit points on the ground; tensions in N.
BOX_HALF_WIDTH, BOX_HEIGHT = 50.0, 50.0
TENSION_LIMITS = TensionLimits(minimum=500.0, maximum=5000.0, preferred=1500.0)


@dataclass(frozen=True)
class SizeStudy:
    """Errors of the laws at each frame width (m), upward and downward: ``errors[direction, law]`` (M,) in m.

    ``cosimulated`` are those of FMUs, upward. ``relative_errors`` (one for each law) are the largest error as a share
    of the largest positioning error of the exact rope, upward.
    """

    widths: tuple[float, ...]
    errors: Mapping[tuple[str, str], Array]
    cosimulated: Mapping[str, Mapping[float, float]]
    relative_errors: Mapping[str, float]


def scaled_robot(robot: Robot, path: Helix, size: float) -> tuple[Robot, Helix]:
    """Scale the three-cable robot and its helix to another size (m), at the same accelerations: the same tensions."""
    factor = size / PAPER_FRAME_WIDTH
    x, y, z = (factor * value for value in robot.platform.start)
    cables = tuple(replace(c, anchor=_scaled_point(c.anchor, factor)) for c in robot.cables)
    scaled = replace(robot, platform=replace(robot.platform, start=(x, y, z)), cables=cables)
    centre, time = _scaled_point(path.centre, factor), factor**0.5
    return scaled, Helix(centre, factor * path.radius, factor * path.rise, path.angle, time * path.duration)


def downward_helix(robot: Robot, path: Helix) -> tuple[Robot, Helix]:
    """The robot at the upper end of its helix, and the way back down."""
    x, y, z = path.position(np.array([path.duration]))[0].tolist()
    placed = replace(robot, platform=replace(robot.platform, start=(x, y, z)))
    centre = (path.centre[0], path.centre[1], z)
    return placed, Helix(centre, path.radius, -path.rise, -path.angle, path.duration)


def cases(parameters: PaperParameters, rope: RobotMaterial) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of scaled robots with both laws, of relaxing and constant ropes on helix and ramp, of a redundant robot."""
    robot, path, ramp = parameters.robots["three"], parameters.helices["three"], parameters.ramps["three"]
    for size in COSIMULATED_WIDTHS:
        scaled, helix = scaled_robot(robot, path, size)
        for law in TENSION_LAWS:
            yield f"size {size:g}/{law}", path_case(with_law(scaled, law), helix, HELIX_SAMPLES)
    pair = dynamic_rope("three")
    relaxing, constant = with_material(robot, rope), with_rope(robot, pair.modulus, pair.damping)
    yield "three/relaxing helix", path_case(relaxing, path, HELIX_SAMPLES)
    yield "three/constant helix", path_case(constant, path, HELIX_SAMPLES)
    yield "three/relaxing", ramp_case(relaxing, ramp, RAMP_SAMPLES["three"])
    eight_cables = redundant_robot(robot, path)
    rigid = path_case(eight_cables, path, HELIX_SAMPLES)
    yield "eight/rigid", rigid
    speeds = elastic_reference(eight_cables, path, rigid.time).speeds
    yield "eight/distributed", replace(rigid, winch_speed=speeds)


def redundant_robot(robot: Robot, path: Helix) -> Robot:
    """Eight cables of the three-cable robot's rope from the corners of a box about its helix."""
    rope = robot.cables[0]
    corners = [
        (path.centre[0] + BOX_HALF_WIDTH * x, path.centre[1] + BOX_HALF_WIDTH * y, z)
        for z in (BOX_HEIGHT, 0.0)
        for x, y in ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    ]
    cables = tuple(Cable(corner, rope.modulus, rope.area, rope.damping, rope.law) for corner in corners)
    return replace(robot, name="eight cables", tension=TENSION_LIMITS, cables=cables)


def compare_sizes(parameters: PaperParameters, records: Records) -> SizeStudy:
    """Compare each law with the exact rope, at every size, upward and downward."""
    robot, path = parameters.robots["three"], parameters.helices["three"]
    errors: dict[tuple[str, str], list[float]] = {}
    cosimulated: dict[str, dict[float, float]] = {law: {} for law in TENSION_LAWS}
    relative_errors: dict[str, float] = {}
    for size in FRAME_WIDTHS:
        up = scaled_robot(robot, path, size)
        for direction, (scaled, helix) in (("up", up), ("down", downward_helix(*up))):
            time = np.linspace(0.0, helix.duration, QUASI_STATIC_SAMPLES + 1)
            exact = follow_path(scaled, helix, time, "exact")
            for law in TENSION_LAWS:
                error = _max_distance(follow_path(scaled, helix, time, law).position, exact.position)
                errors.setdefault((direction, law), []).append(error)
                if direction == "up" and size == PAPER_FRAME_WIDTH:
                    relative_errors[law] = error / _max_distance(exact.position, helix.position(time))
                if direction == "up" and size in COSIMULATED_WIDTHS:
                    cosimulated[law][size] = _cosimulated_error(records[f"size {size:g}/{law}"], exact)
    return SizeStudy(
        FRAME_WIDTHS, {key: np.array(values) for key, values in errors.items()}, cosimulated, relative_errors
    )


def _cosimulated_error(run: SimulationRecord, exact: QuasiStaticMotion) -> float:
    path = np.column_stack([np.interp(exact.time, run.time, run[axis]) for axis in "xyz"])
    return _max_distance(path, exact.position)


def _max_distance(path: Array, other: Array) -> float:
    return float(np.max(np.linalg.norm(path - other, axis=1)))


def _scaled_point(point: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    return factor * point[0], factor * point[1], factor * point[2]
