"""The paper's robots and motions as two parameter sets: one as printed, one that gives the printed figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..robot.robot_file_reader import read_robot
from ..robot.schema import Point, Robot
from ..robot.trajectory import Helix
from ..toml_text import parse_toml

Array = NDArray[np.float64]
ParameterSetName = Literal["printed", "corrected"]

PARAMETER_SETS: tuple[ParameterSetName, ...] = ("printed", "corrected")
DATA_FOLDER = Path(__file__).parent / "data"
QUINTIC_COEFFICIENTS = (6.0, -15.0, 10.0)


@dataclass(frozen=True)
class WinchRamp:
    """Winch speeds that rise from rest at ``accelerations`` (n,), in m/s^2, until they reach ``peak_speed``, in m/s.

    By ``shape`` they are then ``held`` to the end, or as a ``trapezoid`` fall to rest at the end, as steeply as they
    rose. ``start`` in m, ``duration`` in s.
    """

    shape: str
    start: Point
    accelerations: tuple[float, ...]
    peak_speed: float
    duration: float

    def speeds(self, times: Array) -> Array:
        """Winch speeds at times (N,) in s, shape (N, n), in m/s; positive reels in."""
        ramp_time = np.minimum(times, self.duration - times) if self.shape == "trapezoid" else times
        speeds: Array = np.clip(np.outer(ramp_time, self.accelerations), -self.peak_speed, self.peak_speed)
        return speeds

    @property
    def peak_time(self) -> float:
        """Time at which the first winch reaches its peak speed, in s."""
        return self.peak_speed / max(abs(value) for value in self.accelerations)


@dataclass(frozen=True)
class PaperParameters:
    """One set of parameters; robots, helices and ramps by name, those that the set does not have left out.

    ``error_share`` is the share of the printed errors of force and elongation that each reading has.
    """

    name: ParameterSetName
    robots: Mapping[str, Robot]
    helices: Mapping[str, Helix]
    ramps: Mapping[str, WinchRamp]
    error_share: float


def read_parameters(name: ParameterSetName) -> PaperParameters:
    """Read a parameter set from its files, one for each robot and one for the motions; raises RobotFileError."""
    folder = DATA_FOLDER / name
    motions = read_data(folder / "motions.toml")
    return PaperParameters(
        name=name,
        robots={path.stem: read_robot(path) for path in sorted(folder.glob("*.toml")) if path.stem != "motions"},
        helices={robot: _read_helix(table) for robot, table in motions["helix"].items()},
        ramps={robot: _read_ramp(table) for robot, table in motions["ramp"].items()},
        error_share=motions["error_share"],
    )


def read_data(path: Path) -> dict[str, Any]:
    """Read one of the project's own TOML files."""
    return parse_toml(path.read_text(encoding="utf-8"))


def with_law(robot: Robot, law: str) -> Robot:
    """The robot with one tension law in all cables."""
    return replace(robot, cables=tuple(replace(cable, law=law) for cable in robot.cables))


def with_rope(robot: Robot, modulus: float, damping: float = 0.0, area: float | None = None) -> Robot:
    """The robot with ropes of another modulus (Pa), damping (Pa s) and, optionally, area (m^2)."""
    cables = (replace(c, modulus=modulus, damping=damping, area=area or c.area) for c in robot.cables)
    return replace(robot, cables=tuple(cables))


def _read_helix(table: Mapping[str, Any]) -> Helix:
    """Eq. 13: the angle is the sum of the coefficients; the rise is the pitch times the angle."""
    a5, a4, a3 = table["coefficients"]
    half_turns = a5 + a4 + a3
    if not np.allclose(np.array([a5, a4, a3]), half_turns * np.array(QUINTIC_COEFFICIENTS)):
        raise ValueError(f"coefficients {a5}, {a4}, {a3} do not go from rest to rest")
    x, y, z = table["centre"]
    angle = math.pi * half_turns
    return Helix((x, y, z), table["radius"], table["pitch"] * angle, angle, table["duration"])


def _read_ramp(table: Mapping[str, Any]) -> WinchRamp:
    x, y, z = table["start"]
    return WinchRamp(table["shape"], (x, y, z), tuple(table["accelerations"]), table["peak"], table["duration"])
