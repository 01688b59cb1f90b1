"""What a lifelike recording can hide: effects of the list in their own form or in another, and what no list has."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from tests.rig.lifelike.design import Design
from tests.rig.lifelike.little import usual_speed
from tests.rig.lifelike.survey import Survey
from tests.rig.modes import frequencies_of
from tests.rig.registry import EFFECTS

Manner = Literal["right", "wrong", "unlisted"]
Settings = dict[str, Any]


@dataclass(frozen=True)
class Hidden:
    """One thing to hide; `settings` gives its values of the rig at a strength between `least` and `most`.

    Strengths are relative to the robot, so that the same bounds suit all; `least` shows through what is uncertain of
    the robot. What comes by chance in each recording takes it from `random`.
    """

    key: str
    name: str
    manner: Manner
    least: float
    most: float
    settings: Callable[[float, Site], Settings]


@dataclass(frozen=True)
class Site:
    """The robot that something is hidden in, the cable that it is hidden on, and the chance of one recording."""

    design: Design
    survey: Survey
    cable: int
    sign: float
    duration: float
    random: np.random.Generator

    @property
    def modulus(self) -> float:
        """Declared, Pa."""
        return float(self.design.robot.modulus[0])

    @property
    def damping(self) -> float:
        """Declared, Pa s."""
        return float(self.design.robot.damping[0])

    @property
    def strain(self) -> float:
        """Of ropes under their usual tension."""
        return self.design.usual_tension / (self.modulus * float(self.design.robot.area[0]))

    @property
    def speed(self) -> float:
        """Usual, m/s."""
        return usual_speed(self.design)

    @property
    def drum(self) -> float:
        """A radius that suits the robot, m."""
        return 0.06 * self.design.width**0.3

    def drag_area(self, share: float, exponent: float = 2.0) -> float:
        """That gives a share of the weight at twice the usual speed, m^2."""
        return share * self.design.weight / (0.5 * 1.225 * (2.0 * self.speed) ** exponent)

    def beside(self, x: float, y: float, z: float) -> list[float]:
        """A point beside the start, in shares of the robot's width; in the plane of a planar one."""
        aside = self.design.width * np.array([x, 0.0 if self.design.planar else y, z])
        return [float(value) for value in self.design.robot.start + aside]

    def force(self, share: float, x: float, y: float, z: float) -> list[float]:
        """A share of the weight, along x, y, z."""
        return [float(v) for v in share * self.design.weight * np.array([x, 0.0 if self.design.planar else y, z])]


def _spectrum(s: float, site: Site) -> Settings:
    """Relaxation by a straight spectrum from 0.03 to 10 s."""
    return {"modulus": [s / 3.0 * site.modulus] * 6, "time": np.geomspace(0.03, 10.0, 6).tolist()}


def _gusts(s: float, site: Site) -> Settings:
    times = np.sort(site.random.uniform(2.0, site.duration - 3.0, 6))
    ways = site.random.normal(size=(6, 2))
    forces = [site.force(s, way[0], way[1], 0.2) for way in ways]
    return {"amplitude": forces, "times": times.tolist(), "duration": 2.0}


def _frame(s: float, site: Site) -> Settings:
    """A frame that gives way by a share of what the ropes give way, three times as fast as the ropes' modes."""
    constant = site.modulus * float(site.design.robot.area[0]) / site.design.length / s
    angular = 6.0 * np.pi * float(frequencies_of(site.design.robot).max())
    mass = constant / angular**2
    return {"stiffness_constant": constant, "viscosity": 0.1 * angular * mass, "mass": mass}


def _slipping(s: float, site: Site) -> Settings:
    times = np.sort(site.random.uniform(3.0, site.duration - 5.0, 3)).tolist()
    return {"slip": s * site.design.length, "times": times, "cables": [site.cable]}


def _transverse(s: float, site: Site) -> Settings:
    """Resistance across the ropes, in shares of what would damp the slowest mode critically."""
    slowest = 2.0 * np.pi * float(frequencies_of(site.design.robot).min())
    return {"damping": 2.0 * s * site.design.robot.mass * slowest / site.design.robot.count}


def _aside(s: float, site: Site) -> Settings:
    """A shift by a share of the platform's size."""
    x, y, z = (s * site.sign * site.design.size * np.array([0.6, -0.5, 0.62])).tolist()
    return {"x": x, "y": y, "z": z}


def _turning(s: float, site: Site) -> Settings:
    """Resistance to turning, in shares of what would damp the slowest mode critically."""
    body, slowest = site.design.robot.body, 2.0 * np.pi * float(frequencies_of(site.design.robot).min())
    assert body is not None
    return {"damping": 2.0 * s * float(np.linalg.eigvalsh(body.inertia).mean()) * slowest}


def _hysteresis(s: float, site: Site, **others: float) -> Settings:
    return {"force": s * site.design.usual_tension, "yield_strain": 0.05 * site.strain, **others}


def _friction(s: float, site: Site, **others: str) -> Settings:
    return {"coefficient": s, "smoothing": 0.03 * site.speed, **others}


RIGHT = (
    Hidden("damping", "damping", "right", 1.5, 20.0, lambda s, w: {"damping": w.damping * (1 + s)}),
    Hidden("modulus", "modulus", "right", 0.08, 0.5, lambda s, w: {"modulus": w.modulus * (1 + w.sign * s)}),
    Hidden(
        "modulus-one",
        "modulus",
        "right",
        0.1,
        0.5,
        lambda s, w: {"modulus": w.modulus * (1 + w.sign * s), "cables": [w.cable]},
    ),
    Hidden("relaxation", "relaxation", "right", 0.03, 1.5, lambda s, w: {"modulus": s * w.modulus, "time": 0.4}),
    Hidden("hysteresis", "hysteresis", "right", 0.01, 0.4, _hysteresis),
    Hidden("creep", "creep", "right", 0.02, 1.0, lambda s, w: {"compliance": s / w.modulus, "time": 4.0}),
    Hidden("thermal", "thermal", "right", 1e-6, 1e-4, lambda s, w: {"expansion": s, "rise": 15.0, "time": 8.0}),
    Hidden(
        "sag",
        "sag",
        "right",
        0.01,
        0.5,
        lambda s, w: {"linear_density": s * w.design.usual_tension / (9.81 * w.design.length)},
    ),
    Hidden("pulley", "pulley", "right", 2e-4, 0.03, lambda s, w: {"radius": s * w.design.width}),
    Hidden(
        "anchor",
        "anchor",
        "right",
        15.0,
        400.0,
        lambda s, w: dict(
            zip("xyz", s * w.survey.anchor * np.array([0.6, 0.0 if w.design.planar else -0.5, 0.6]), strict=True),
            cables=[w.cable],
        ),
    ),
    Hidden("drum", "drum", "right", 1e-3, 0.05, lambda s, w: {"radius_ratio": 1 + w.sign * s}),
    Hidden(
        "drum-eccentricity",
        "drum",
        "right",
        1e-3,
        0.1,
        lambda s, w: {"eccentricity": s, "phase": 0.8, "radius": w.drum},
    ),
    Hidden("drum-slip", "drum", "right", 1e-4, 0.05, lambda s, w: {"slip": s / w.design.usual_tension}),
    Hidden("friction", "friction", "right", 0.005, 0.2, _friction),
    Hidden("friction-cell", "friction", "right", 0.005, 0.2, lambda s, w: _friction(s, w, law_at="cell")),
    Hidden("payload", "payload", "right", 0.03, 0.4, lambda s, w: {"mass": s * w.design.robot.mass}),
    Hidden("drag", "drag", "right", 5e-3, 0.5, lambda s, w: {"drag_area": w.drag_area(s)}),
    Hidden("slack", "slack", "right", 0.2, 1.5, lambda s, w: {"softness": s * w.design.usual_tension}),
    Hidden("sensor_delay", "sensor_delay", "right", 5e-3, 0.2, lambda s, w: {"seconds": s}),
    Hidden(
        "sensor_delay-position",
        "sensor_delay",
        "right",
        5e-3,
        0.2,
        lambda s, w: {"seconds": s, "outputs": "position"},
    ),
    Hidden(
        "sensor_gain", "sensor_gain", "right", 0.03, 0.2, lambda s, w: {"gain": 1 + w.sign * s, "cables": [w.cable]}
    ),
    Hidden(
        "sensor_offset",
        "sensor_offset",
        "right",
        8.0,
        60.0,
        lambda s, w: {"force": w.sign * s * w.survey.tension_offset, "cables": [w.cable]},
    ),
    Hidden("sensor_delay-low-pass", "sensor_delay", "right", 5e-3, 0.2, lambda s, w: {"seconds": s, "form": "lag"}),
)

WRONG = (
    Hidden(
        "damping-power",
        "damping",
        "wrong",
        1.5,
        30.0,
        lambda s, w: {"damping": w.damping * (1 + s), "exponent": 0.7, "reference": 0.1 * w.strain},
    ),
    Hidden("relaxation-spectrum", "relaxation", "wrong", 0.03, 1.5, _spectrum),
    Hidden("hysteresis-beta", "hysteresis", "wrong", 0.01, 0.4, lambda s, w: _hysteresis(s, w, beta=0.6)),
    Hidden(
        "creep-power",
        "creep",
        "wrong",
        0.02,
        1.0,
        lambda s, w: {"compliance": s / w.modulus, "time": 4.0, "form": "power"},
    ),
    Hidden(
        "thermal-hyperbolic",
        "thermal",
        "wrong",
        1e-6,
        1e-4,
        lambda s, w: {"expansion": s, "rise": 15.0, "time": 8.0, "form": "hyperbolic"},
    ),
    Hidden(
        "sag-steep",
        "sag",
        "wrong",
        0.01,
        0.5,
        lambda s, w: {"linear_density": s * w.design.usual_tension / (9.81 * w.design.length), "form": "steep"},
    ),
    Hidden("pulley-tilted", "pulley", "wrong", 2e-4, 0.03, lambda s, w: {"radius": s * w.design.width, "tilt": 0.12}),
    Hidden(
        "drum-layers",
        "drum",
        "wrong",
        1e-3,
        0.05,
        lambda s, w: {"radius_ratio": 1 + w.sign * s, "build_up": 0.5 * w.sign * s / w.design.width},
    ),
    Hidden(
        "drum-oval",
        "drum",
        "wrong",
        1e-3,
        0.1,
        lambda s, w: {"eccentricity": s, "second_harmonic": 0.25 * s, "phase": 0.8, "radius": w.drum},
    ),
    Hidden("friction-linear", "friction", "wrong", 0.02, 0.25, lambda s, w: _friction(s, w, form="linear")),
    Hidden("friction-stribeck", "friction", "wrong", 0.005, 0.2, lambda s, w: _friction(s, w, form="stribeck")),
    Hidden("drag-linear", "drag", "wrong", 5e-3, 0.5, lambda s, w: {"drag_area": w.drag_area(s, 1.0), "exponent": 1.0}),
    Hidden(
        "slack-root", "slack", "wrong", 0.2, 1.0, lambda s, w: {"softness": s * w.design.usual_tension, "form": "root"}
    ),
    Hidden(
        "sensor_delay-lag",
        "sensor_delay",
        "wrong",
        5e-3,
        0.2,
        lambda s, w: {"seconds": s, "form": "lag", "order": 2},
    ),
    Hidden(
        "sensor_gain-bent",
        "sensor_gain",
        "wrong",
        0.03,
        0.2,
        lambda s, w: {"gain": 1 + w.sign * s, "bend": 0.3 * s, "cables": [w.cable]},
    ),
)

UNLISTED = (
    Hidden(
        "swing",
        "unlisted_swing",
        "unlisted",
        0.02,
        0.3,
        lambda s, w: {
            "mass": s * w.design.robot.mass,
            "length": 0.04 * w.design.width,
            "viscosity": 0.05 * s * w.design.robot.mass,
        },
    ),
    Hidden("gusts", "unlisted_gusts", "unlisted", 3e-3, 0.2, _gusts),
    Hidden("slipping", "unlisted_slipping", "unlisted", 1e-5, 5e-3, _slipping),
    Hidden(
        "magnet",
        "unlisted_magnet",
        "unlisted",
        3e-3,
        0.3,
        lambda s, w: {
            "strength": s * w.design.weight * (0.1 * w.design.width) ** 2,
            "centre": w.beside(-0.1, 0.05, 0.1),
            "core": 0.05 * w.design.width,
        },
    ),
    Hidden(
        "bungee",
        "unlisted_bungee",
        "unlisted",
        3e-3,
        0.3,
        lambda s, w: {
            "stiffness_constant": s * w.design.weight / (0.05 * w.design.width),
            "point": w.beside(0.06, -0.08, -0.15),
            "rest": 0.15 * w.design.width,
        },
    ),
    Hidden(
        "shaker",
        "unlisted_shaker",
        "unlisted",
        2e-3,
        0.1,
        lambda s, w: {"amplitude": w.force(s, 1.0, 0.5, 1.0), "frequency": 0.37 * w.design.width**-0.1},
    ),
    Hidden(
        "filling",
        "unlisted_filling",
        "unlisted",
        0.02,
        0.4,
        lambda s, w: {"rate": s * w.design.robot.mass / w.duration},
    ),
    Hidden(
        "sideways",
        "unlisted_sideways",
        "unlisted",
        5e-3,
        0.5,
        lambda s, w: {
            "constant": s * w.design.weight / w.speed,
            "axis": [0.0, 1.0, 0.0] if w.design.planar else [0.0, 0.0, 1.0],
        },
    ),
    Hidden("frame", "unlisted_frame", "unlisted", 0.05, 1.0, _frame),
    Hidden("stiffening", "unlisted_stiffening", "unlisted", 0.05, 3.0, lambda s, w: {"quadratic": s / w.strain}),
)

PAIRS = (
    ("modulus", "damping"),
    ("friction", "payload"),
    ("pulley", "friction-linear"),
    ("hysteresis", "sensor_gain"),
    ("relaxation", "drum"),
    ("drag", "sensor_offset"),
    ("anchor", "sensor_delay"),
    ("creep", "payload"),
)

# Only on platforms that turn.
ON_PLATFORMS = (
    Hidden("transverse_damping", "transverse_damping", "right", 0.01, 3.0, _transverse),
    Hidden(
        "transverse_damping-quadratic",
        "transverse_damping",
        "wrong",
        0.01,
        3.0,
        lambda s, w: {**_transverse(s, w), "exponent": 2.0, "reference": w.speed},
    ),
    Hidden("centre_of_mass", "centre_of_mass", "right", 0.05, 0.6, _aside),
    Hidden("attachment", "attachment", "right", 0.01, 0.5, lambda s, w: {**_aside(s, w), "cables": [w.cable]}),
    Hidden(
        "inertia",
        "inertia",
        "right",
        0.15,
        3.0,
        lambda s, w: {"factor_x": 1 + s, "factor_y": 1 + 0.5 * s, "factor_z": 1 + 0.8 * s},
    ),
    Hidden("rotational_drag", "rotational_drag", "right", 0.01, 5.0, _turning),
    Hidden(
        "payload-aside",
        "payload",
        "right",
        0.03,
        0.4,
        lambda s, w: {"mass": s * w.design.robot.mass, "x": 0.5 * w.design.size, "z": -0.4 * w.design.size},
    ),
    Hidden(
        "rotational_drag-quadratic",
        "rotational_drag",
        "wrong",
        0.01,
        20.0,
        lambda s, w: {**_turning(s, w), "exponent": 2.0, "reference": w.speed / w.design.size},
    ),
)

HIDDEN: Mapping[str, Hidden] = MappingProxyType({one.key: one for one in (*RIGHT, *WRONG, *UNLISTED)})
HIDDEN_ON_PLATFORMS: Mapping[str, Hidden] = MappingProxyType(
    {one.key: one for one in (*RIGHT, *WRONG, *UNLISTED, *ON_PLATFORMS) if not EFFECTS[one.name].of_points}
)


def names_of(parts: Sequence[Hidden]) -> tuple[str, ...]:
    """The effects, by the names that formats use."""
    return tuple(dict.fromkeys(part.name for part in parts))
