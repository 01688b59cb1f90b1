"""The robot as its owner declares it, read from a robot file."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class TensionLimits:
    """Where the start tensions of a robot with more than three cables may lie, N; `preferred` also one per cable."""

    minimum: float = 0.0
    maximum: float = float("inf")
    preferred: float | Vector = 0.0


@dataclass(frozen=True)
class Noise:
    """Standard deviation of one sample: position m, tension N, winch speed m/s, orientation about each axis rad."""

    position: float = 0.0
    tension: float = 0.0
    winch_speed: float = 0.0
    orientation: float = 0.0


@dataclass(frozen=True)
class Body:
    """What a platform that turns has beside a point mass, in its own frame; m and kg m^2.

    `inertia` (3, 3) is about the `centre` of mass, `orientation` the rotation matrix of the start; `points` are masses
    carried, in kg, with their places from the centre.
    """

    inertia: Vector
    centre: Vector
    attachments: Vector
    orientation: Vector = field(default_factory=lambda: np.eye(3))
    points: tuple[tuple[float, Vector], ...] = ()


@dataclass(frozen=True)
class Robot:
    """A point mass, or a `body`, on n cables; one row or entry per cable, SI units, z up.

    `start` is the origin of a body's frame.
    """

    gravity: float
    mass: float
    start: Vector
    anchors: Vector
    modulus: Vector
    area: Vector
    damping: Vector
    linear: NDArray[np.bool_]
    tension: TensionLimits = field(default_factory=TensionLimits)
    noise: Noise = field(default_factory=Noise)
    name: str = "robot"
    body: Body | None = None

    @property
    def count(self) -> int:
        """Number of cables."""
        return len(self.anchors)


LIMITS = ("minimum", "maximum", "preferred")
NOISES = ("position_noise", "tension_noise", "winch_speed_noise", "orientation_noise")


def robot_from(content: Mapping[str, Any]) -> Robot:
    """The robot that the content of a robot file declares; its [effect] tables are not read here."""
    cables = content["cable"]
    sensors, limits = content.get("sensors", {}), content.get("tension") or {}

    def column(key: str, default: float | None = None) -> Vector:
        rows = [cable[key] if default is None else cable.get(key, default) for cable in cables]
        return np.array(rows, float)

    return Robot(
        name=content.get("name", "robot"),
        gravity=float(content.get("gravity", 9.81)),
        mass=float(content["platform"]["mass"]),
        start=np.array(content["platform"]["start"], float),
        anchors=column("anchor"),
        modulus=column("modulus"),
        area=column("area"),
        damping=column("damping", 0.0),
        linear=np.array([cable.get("law", "logarithmic") == "linear" for cable in cables]),
        tension=TensionLimits(**{key: float(limits[key]) for key in LIMITS if key in limits}),
        noise=Noise(**{key.removesuffix("_noise"): float(value) for key, value in sensors.items() if key in NOISES}),
        body=_body_from(content),
    )


def _body_from(content: Mapping[str, Any]) -> Body | None:
    """What the robot file says of a platform that turns."""
    platform = content["platform"]
    if "inertia" not in platform:
        return None
    w, x, y, z = platform.get("start_orientation", (1.0, 0.0, 0.0, 0.0))
    return Body(
        inertia=np.array(platform["inertia"], float),
        centre=np.array(platform.get("centre_of_mass", (0.0, 0.0, 0.0)), float),
        attachments=np.array([cable.get("attachment", (0.0, 0.0, 0.0)) for cable in content["cable"]], float),
        orientation=np.asarray(Rotation.from_quat((x, y, z, w)).as_matrix(), float),
    )


def load_robot(path: str | Path) -> Robot:
    """The robot of a robot file."""
    with open(path, "rb") as file:
        return robot_from(tomllib.load(file))
