"""The paper's robots and motions: one set as printed, one that gives the printed figures."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..robots.reading import read_robot
from ..robots.robot import Point, Robot
from ..trajectory import Helix

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

Array = NDArray[np.float64]
SetName = Literal["printed", "corrected"]

SETS: tuple[SetName, ...] = ("printed", "corrected")
DATA = Path(__file__).parent / "data"
QUINTIC = (6.0, -15.0, 10.0)


@dataclass(frozen=True)
class Ramp:
    """Winch speeds that rise from rest at ``accelerations`` (n,), in m/s^2, until they reach ``peak``, in m/s.

    They are then ``held`` to the end, or as a ``trapezoid`` fall to rest at the end, as steeply as they rose. ``start``
    in m, ``duration`` in s.
    """

    shape: str
    start: Point
    accelerations: tuple[float, ...]
    peak: float
    duration: float

    def speeds(self, times: Array) -> Array:
        """Winch speeds at times (N,) in s, shape (N, n), in m/s; positive reels in."""
        rising = np.minimum(times, self.duration - times) if self.shape == "trapezoid" else times
        speeds: Array = np.clip(np.outer(rising, self.accelerations), -self.peak, self.peak)
        return speeds

    @property
    def reached(self) -> float:
        """When the first winch reaches its peak, in s."""
        return self.peak / max(abs(value) for value in self.accelerations)


@dataclass(frozen=True)
class Parameters:
    """One set of parameters; robots, helices and ramps by name, those that the set does not have left out.

    ``error_share`` is how much of the printed errors of force and elongation each reading has.
    """

    name: SetName
    robots: Mapping[str, Robot]
    helices: Mapping[str, Helix]
    ramps: Mapping[str, Ramp]
    error_share: float


def read_parameters(name: SetName) -> Parameters:
    """A set from its files, one for each robot and one for the motions; raises RobotFileError."""
    folder = DATA / name
    motions = read_data(folder / "motions.toml")
    return Parameters(
        name=name,
        robots={path.stem: read_robot(path) for path in sorted(folder.glob("*.toml")) if path.stem != "motions"},
        helices={robot: _helix(table) for robot, table in motions["helix"].items()},
        ramps={robot: _ramp(table) for robot, table in motions["ramp"].items()},
        error_share=motions["error_share"],
    )


def read_data(path: Path) -> dict[str, Any]:
    """One of the project's own TOML files."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def with_law(robot: Robot, law: str) -> Robot:
    """The robot with one tension law in all cables."""
    return replace(robot, cables=tuple(replace(cable, law=law) for cable in robot.cables))


def with_rope(robot: Robot, modulus: float, damping: float = 0.0, area: float | None = None) -> Robot:
    """The robot with ropes of another modulus (Pa), damping (Pa s) and, where given, area (m^2)."""
    cables = (replace(c, modulus=modulus, damping=damping, area=area or c.area) for c in robot.cables)
    return replace(robot, cables=tuple(cables))


def with_start(robot: Robot, start: Point) -> Robot:
    """The robot at another start, in m."""
    return replace(robot, platform=replace(robot.platform, start=start))


def _helix(table: Mapping[str, Any]) -> Helix:
    """Eq. 13: the angle is the sum of the coefficients; the rise is the pitch times the angle."""
    a5, a4, a3 = table["coefficients"]
    turned = a5 + a4 + a3
    if not np.allclose(np.array([a5, a4, a3]), turned * np.array(QUINTIC)):
        raise ValueError(f"coefficients {a5}, {a4}, {a3} do not go from rest to rest")
    x, y, z = table["centre"]
    angle = math.pi * turned
    return Helix((x, y, z), table["radius"], table["pitch"] * angle, angle, table["duration"])


def _ramp(table: Mapping[str, Any]) -> Ramp:
    x, y, z = table["start"]
    return Ramp(table["shape"], (x, y, z), tuple(table["accelerations"]), table["peak"], table["duration"])
