"""The ways in which an effect can act: how one strength becomes values of the rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from tests.rig import Robot

Settings = dict[str, Any]


@dataclass(frozen=True)
class Form:
    """An effect of the rig in one form.

    ``settings`` gives its values at a strength, which is at least zero (where the effect is absent) and at most
    ``most``; the search for a size begins at ``start``.
    """

    key: str
    name: str
    settings: Callable[[float, Robot], Settings]
    start: float
    most: float

    @property
    def listed(self) -> bool:
        """Whether it is one that the project knows."""
        return not self.name.startswith("unlisted_")


def _modulus(robot: Robot) -> float:
    return float(robot.modulus[0])


def _damping(robot: Robot) -> float:
    return float(robot.damping[0])


def _span(robot: Robot) -> float:
    """A length that suits the robot's size: a hundredth of its first cable."""
    return 0.01 * float(np.linalg.norm(robot.anchors[0] - robot.start))


def _beside(robot: Robot, x: float, y: float, z: float) -> list[float]:
    """A point beside the start, in hundredths of the first cable."""
    return [float(value) for value in robot.start + _span(robot) * np.array([x, y, z])]


LISTED = (
    Form("damping", "damping", lambda s, r: {"damping": _damping(r) * (1 + s)}, 0.2, 30.0),
    Form("damping-one", "damping", lambda s, r: {"damping": _damping(r) * (1 + s), "cables": [3]}, 0.3, 60.0),
    Form("modulus", "modulus", lambda s, r: {"modulus": _modulus(r) * (1 - s)}, 0.01, 0.5),
    Form("modulus-one", "modulus", lambda s, r: {"modulus": _modulus(r) * (1 + s), "cables": [2]}, 0.02, 1.0),
    Form("relaxation", "relaxation", lambda s, r: {"modulus": s * _modulus(r), "time": 0.4}, 0.02, 2.0),
    Form(
        "relaxation-two",
        "relaxation",
        lambda s, r: {"modulus": [s * _modulus(r), 0.7 * s * _modulus(r)], "time": [0.1, 2.0]},
        0.02,
        2.0,
    ),
    Form("hysteresis", "hysteresis", lambda s, r: {"force": s, "yield_strain": 3e-5}, 2.0, 300.0),
    Form("creep", "creep", lambda s, r: {"compliance": s, "time": 4.0}, 1e-13, 1e-10),
    Form("creep-viscous", "creep", lambda s, r: {"compliance": s, "time": 1.0, "form": "viscous"}, 1e-14, 1e-11),
    Form("thermal", "thermal", lambda s, r: {"expansion": 1.2e-5, "rise": s, "time": 5.0}, 1.0, 150.0),
    Form("thermal-rate", "thermal", lambda s, r: {"expansion": 1.2e-5, "rate": s}, 0.1, 9.0),
    Form("sag", "sag", lambda s, r: {"linear_density": s}, 0.02, 1.0),
    Form("pulley", "pulley", lambda s, r: {"radius": s}, 0.01, 0.4),
    Form("anchor", "anchor", lambda s, r: {"x": 0.5 * s, "y": -0.4 * s, "z": 0.77 * s, "cables": [1]}, 0.01, 2.0),
    Form("drum", "drum", lambda s, r: {"radius_ratio": 1 + s}, 1e-3, 0.2),
    Form(
        "drum-eccentricity",
        "drum",
        lambda s, r: {"eccentricity": s, "phase": 0.8, "radius": float(0.05 + 0.1 * _span(r))},
        0.01,
        0.3,
    ),
    Form("drum-slip", "drum", lambda s, r: {"slip": s}, 1e-7, 1e-4),
    Form("friction", "friction", lambda s, r: {"coefficient": s}, 2e-3, 0.3),
    Form("friction-cell", "friction", lambda s, r: {"coefficient": s, "law_at": "cell"}, 2e-3, 0.3),
    Form("payload", "payload", lambda s, r: {"mass": s * r.mass}, 2e-3, 0.5),
    Form("drag", "drag", lambda s, r: {"drag_area": s}, 1.0, 400.0),
    Form("drag-wind", "drag", lambda s, r: {"drag_area": s, "wind": [2.0, 1.0, 0.5]}, 0.5, 60.0),
    Form("slack", "slack", lambda s, r: {"softness": s}, 100.0, 3000.0),
    Form("sensor_delay", "sensor_delay", lambda s, r: {"seconds": s}, 2e-3, 0.3),
    Form("sensor_delay-position", "sensor_delay", lambda s, r: {"seconds": s, "outputs": "position"}, 1e-3, 0.3),
    Form("sensor_gain", "sensor_gain", lambda s, r: {"gain": 1 + s, "cables": [3]}, 1e-3, 0.5),
    Form("sensor_gain-position", "sensor_gain", lambda s, r: {"gain": 1 + s, "outputs": "position"}, 1e-4, 0.2),
    Form("sensor_offset", "sensor_offset", lambda s, r: {"force": s, "cables": [2]}, 1.0, 300.0),
    Form("sensor_offset-all", "sensor_offset", lambda s, r: {"force": s}, 1.0, 300.0),
    Form("sensor_offset-position", "sensor_offset", lambda s, r: {"place": [0.5 * s, -0.4 * s, 0.77 * s]}, 1e-3, 0.1),
)

UNLISTED = (
    Form(
        "wave",
        "unlisted_wave",
        lambda s, r: {"amplitude": [s, 0.0, 0.5 * s], "wavelength": 6 * _span(r)},
        2.0,
        300.0,
    ),
    Form(
        "magnet",
        "unlisted_magnet",
        lambda s, r: {"strength": s, "centre": _beside(r, -3.0, 2.0, 3.0), "core": 2 * _span(r)},
        5.0,
        3000.0,
    ),
    Form("sideways", "unlisted_sideways", lambda s, r: {"constant": s}, 5.0, 3000.0),
    Form(
        "bungee",
        "unlisted_bungee",
        lambda s, r: {"stiffness_constant": s, "point": _beside(r, 2.0, -3.0, -6.0), "rest": 6 * _span(r)},
        1.0,
        1000.0,
    ),
    Form(
        "shaker",
        "unlisted_shaker",
        lambda s, r: {"amplitude": [s, 0.5 * s, s], "frequency": 0.37 if r.mass > 200 else 1.7},
        1.0,
        300.0,
    ),
    Form(
        "swing",
        "unlisted_swing",
        lambda s, r: {"mass": s * r.mass, "length": 2.5 * _span(r), "viscosity": 0.05 * s * r.mass},
        0.01,
        0.4,
    ),
    Form(
        "frame",
        "unlisted_frame",
        lambda s, r: {"stiffness_constant": 1.0 / s, "viscosity": 2e3, "mass": 50.0},
        1e-7,
        1e-5,
    ),
    Form("stiffening", "unlisted_stiffening", lambda s, r: {"quadratic": s}, 5.0, 3000.0),
    Form("pushing", "unlisted_pushing", lambda s, r: {}, 1.0, 1.0),
    Form("filling", "unlisted_filling", lambda s, r: {"rate": s}, 0.05, 10.0),
)

FORMS: Mapping[str, Form] = MappingProxyType({form.key: form for form in (*LISTED, *UNLISTED)})


def forms_of(name: str) -> tuple[Form, ...]:
    """All forms of a listed effect."""
    return tuple(form for form in LISTED if form.name == name)
