"""Beyond the paper: the laws against a rope on a drum, the relaxing rope, and a redundant robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..control.feedforward import elastic_reference
from ..materials import RobotMaterial, with_material
from ..robots.robot import Cable, Robot, TensionLimits
from ..trajectory import Helix
from .drum import Followed, follow
from .helix import LAWS
from .parameters import Parameters, with_law, with_rope
from .ramps import SAMPLES as RAMP_SAMPLES
from .ramps import dynamic_rope
from .records import Case, Record, Records, helix_case, ramp_case

Array = NDArray[np.float64]

# Widths of the frame in m; the three-cable robot's is 100 m.
SIZES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
COSIMULATED = (1.0, 10.0, 100.0, 500.0)
OWN_SIZE = 100.0
FOLLOWED_SAMPLES, HELIX_SAMPLES = 400, 500
# The redundant robot: a box about the helix, its lower exit points on the ground; tensions in N.
HALF_WIDTH, HEIGHT = 50.0, 50.0
LIMITS = TensionLimits(minimum=500.0, maximum=5000.0, preferred=1500.0)


@dataclass(frozen=True)
class Sizes:
    """How far off the laws are at each size (m), upward and downward: ``errors[direction, law]`` (M,) in m.

    ``cosimulated`` are those of FMUs, upward. ``share`` (one for each law) is the largest error as a share of the
    largest positioning error of the exact rope, upward.
    """

    sizes: tuple[float, ...]
    errors: Mapping[tuple[str, str], Array]
    cosimulated: Mapping[str, Mapping[float, float]]
    share: Mapping[str, float]


def sized(robot: Robot, path: Helix, size: float) -> tuple[Robot, Helix]:
    """The three-cable robot and its helix in another size (m), at the same accelerations: the same tensions."""
    factor = size / OWN_SIZE
    x, y, z = (factor * value for value in robot.platform.start)
    cables = tuple(replace(c, anchor=_scaled(c.anchor, factor)) for c in robot.cables)
    small = replace(robot, platform=replace(robot.platform, start=(x, y, z)), cables=cables)
    centre, time = _scaled(path.centre, factor), factor**0.5
    return small, Helix(centre, factor * path.radius, factor * path.rise, path.angle, time * path.duration)


def downward(robot: Robot, path: Helix) -> tuple[Robot, Helix]:
    """The robot at the upper end of its helix, and the way back down."""
    x, y, z = path.position(np.array([path.duration]))[0].tolist()
    placed = replace(robot, platform=replace(robot.platform, start=(x, y, z)))
    centre = (path.centre[0], path.centre[1], z)
    return placed, Helix(centre, path.radius, -path.rise, -path.angle, path.duration)


def cases(parameters: Parameters, rope: RobotMaterial) -> Iterator[tuple[str, Case]]:
    """Sizes with both laws; the helix and the ramp with relaxation and with constant pairs; the redundant robot."""
    robot, path, ramp = parameters.robots["three"], parameters.helices["three"], parameters.ramps["three"]
    for size in COSIMULATED:
        own, helix = sized(robot, path, size)
        for law in LAWS:
            yield f"size {size:g}/{law}", helix_case(with_law(own, law), helix, HELIX_SAMPLES)
    pair = dynamic_rope("three")
    relaxing, constant = with_material(robot, rope), with_rope(robot, pair.modulus, pair.damping)
    yield "three/relaxing helix", helix_case(relaxing, path, HELIX_SAMPLES)
    yield "three/constant helix", helix_case(constant, path, HELIX_SAMPLES)
    yield "three/relaxing", ramp_case(relaxing, ramp, RAMP_SAMPLES["three"])
    eight = redundant(robot, path)
    rigid = helix_case(eight, path, HELIX_SAMPLES)
    yield "eight/rigid", rigid
    speeds = elastic_reference(eight, path, rigid.time).speeds
    yield "eight/distributed", replace(rigid, winch_speed=speeds)


def redundant(robot: Robot, path: Helix) -> Robot:
    """Eight cables of the three-cable robot's rope from the corners of a box about its helix."""
    rope = robot.cables[0]
    corners = [
        (path.centre[0] + HALF_WIDTH * x, path.centre[1] + HALF_WIDTH * y, z)
        for z in (HEIGHT, 0.0)
        for x, y in ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    ]
    cables = tuple(Cable(corner, rope.modulus, rope.area, rope.damping, rope.law) for corner in corners)
    return replace(robot, name="eight cables", tension=LIMITS, cables=cables)


def compare_sizes(parameters: Parameters, records: Records) -> Sizes:
    """Each law less the exact rope, at every size and both ways."""
    robot, path = parameters.robots["three"], parameters.helices["three"]
    errors: dict[tuple[str, str], list[float]] = {}
    cosimulated: dict[str, dict[float, float]] = {law: {} for law in LAWS}
    share: dict[str, float] = {}
    for size in SIZES:
        up = sized(robot, path, size)
        for direction, (own, helix) in (("up", up), ("down", downward(*up))):
            time = np.linspace(0.0, helix.duration, FOLLOWED_SAMPLES + 1)
            exact = follow(own, helix, time, "exact")
            for law in LAWS:
                off = _off(follow(own, helix, time, law).position, exact.position)
                errors.setdefault((direction, law), []).append(off)
                if direction == "up" and size == OWN_SIZE:
                    share[law] = off / _off(exact.position, helix.position(time))
                if direction == "up" and size in COSIMULATED:
                    cosimulated[law][size] = _cosimulated_off(records[f"size {size:g}/{law}"], exact)
    return Sizes(SIZES, {key: np.array(values) for key, values in errors.items()}, cosimulated, share)


def _cosimulated_off(run: Record, exact: Followed) -> float:
    path = np.column_stack([np.interp(exact.time, run.time, run[axis]) for axis in "xyz"])
    return _off(path, exact.position)


def _off(path: Array, other: Array) -> float:
    return float(np.max(np.linalg.norm(path - other, axis=1)))


def _scaled(point: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    return factor * point[0], factor * point[1], factor * point[2]
