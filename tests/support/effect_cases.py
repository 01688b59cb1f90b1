"""Every effect with each of its forms: its values as the rig takes them, and as the laws do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tautwire.robot.schema import PER_CABLE_COMPONENTS, EffectSetting, Robot
from tautwire_fmu.laws.effects import BY_NAME


@dataclass(frozen=True)
class Case:
    """One effect in one form; ``rig`` and ``law`` are its values there, ``cables`` where it holds if not for all."""

    name: str
    rig: Mapping[str, Any]
    law: Mapping[str, float]
    cables: tuple[int, ...] = ()

    def setting(self, robot: Robot) -> EffectSetting:
        """As the robot has it."""
        everywhere = robot.cable_numbers if BY_NAME[self.name].component in PER_CABLE_COMPONENTS else ()
        return EffectSetting(self.name, self.law, self.cables or everywhere)

    def for_rig(self) -> dict[str, Any]:
        """As the rig has it."""
        return {**self.rig, **({"cables": list(self.cables)} if self.cables else {})}

    def __str__(self) -> str:
        return "-".join([self.name, *self.law])


def same(name: str, *cables: int, **values: float) -> Case:
    """An effect whose values have the same names in the rig and in the laws."""
    return Case(name, values, values, cables)


BRANCHES = {"modulus": 3e10, "time": 0.5, "modulus_2": 1e10, "time_2": 5.0, "modulus_3": 2e10, "time_3": 0.02}
CASES = (
    same("damping", damping=1.7e9),
    same("modulus", modulus=0.9e11),
    same("modulus", 2, modulus=0.8e11),
    same("relaxation", modulus=3e10, time=0.5),
    Case("relaxation", {"modulus": [3e10, 1e10, 2e10], "time": [0.5, 5.0, 0.02]}, BRANCHES),
    same("hysteresis", force=60.0, yield_strain=1e-4),
    same("hysteresis", force=60.0, yield_strain=3e-5, exponent=2.0),
    same("creep", compliance=1e-12, time=5.0),
    Case("creep", {"compliance": 1e-12, "time": 5.0, "form": "viscous"}, {"fluidity": 2e-13}),
    same("thermal", rise=10.0, time=20.0, expansion=1.2e-5),
    same("thermal", rate=0.5, expansion=2e-5),
    same("sag", linear_density=0.1),
    same("sag", 2, 3, linear_density=0.4),
    same("pulley", radius=0.15),
    same("anchor", 1, x=0.05, y=0.02, z=-0.1),
    same("drum", radius_ratio=1.01),
    same("drum", eccentricity=0.02, phase=1.0, radius=0.15),
    same("drum", slip=1e-6),
    same("friction", coefficient=0.05),
    Case("friction", {"coefficient": 0.05, "law_at": "cell"}, {"coefficient_at_cell": 0.05}),
    same("payload", mass=20.0),
    same("drag", drag_area=5.0),
    Case(
        "drag",
        {"drag_area": 5.0, "wind": [2.0, 1.0, 0.5]},
        {"drag_area": 5.0, "wind_x": 2.0, "wind_y": 1.0, "wind_z": 0.5},
    ),
    same("slack", softness=300.0),
    same("transverse_damping", damping=40.0),
    Case("sensor_gain", {"gain": 1.02}, {"tension_gain": 1.02}, (3,)),
    Case("sensor_gain", {"gain": 1.001, "outputs": "position"}, {"position_gain": 1.001}),
    Case("sensor_offset", {"force": -20.0}, {"tension_offset": -20.0}, (2,)),
    Case(
        "sensor_offset",
        {"place": [0.02, -0.03, 0.01]},
        {"position_offset_x": 0.02, "position_offset_y": -0.03, "position_offset_z": 0.01},
    ),
    Case("sensor_delay", {"seconds": 0.023}, {"tension_delay": 0.023}),
    Case("sensor_delay", {"seconds": 0.05, "outputs": "position"}, {"position_delay": 0.05}),
    Case("sensor_delay", {"seconds": 0.05, "form": "lag"}, {"tension_time_constant": 0.05}),
)
# Those on no list; the rig has frames and swinging loads in other forms, and knows `stiffening` by another name.
UNLISTED_CASES = (
    same("frame", compliance=3e-7),
    same("hanging_load", weight=200.0),
    same("stiffening", 1, 3, quadratic=100.0),
)
# On platforms that turn: those that only they can have, and those whose forces act at a point of theirs.
RIGID_CASES = (
    same("centre_of_mass", x=0.02, y=-0.01, z=0.03),
    same("attachment", 2, x=0.02, y=0.01, z=-0.03),
    same("inertia", factor_x=1.5, factor_y=0.8, factor_z=1.2),
    same("rotational_drag", damping=20.0),
    same("transverse_damping", damping=30.0),
    same("transverse_damping", 1, 3, damping=60.0),
    same("payload", mass=6.0, x=0.1, y=-0.05, z=0.3),
    same("payload", mass=6.0),
    Case(
        "drag",
        {"drag_area": 3.0, "wind": [2.0, 1.0, 0.5]},
        {"drag_area": 3.0, "wind_x": 2.0, "wind_y": 1.0, "wind_z": 0.5},
    ),
    same("sag", linear_density=0.1),
    same("pulley", radius=0.05),
    same("anchor", 1, x=0.05, y=0.02, z=-0.1),
    same("damping", damping=5e8),
    same("relaxation", modulus=3e10, time=0.5),
)
PAIRS = (
    (same("anchor", 1, 2, x=0.05, y=0.2, z=-0.1), same("pulley", radius=0.15)),
    (same("modulus", modulus=0.9e11), same("creep", compliance=1e-12, time=5.0)),
    (same("modulus", modulus=0.9e11), same("damping", damping=1.7e9), same("sag", linear_density=0.4)),
    (same("friction", coefficient=0.05), same("drum", slip=1e-6)),
    (same("relaxation", modulus=3e10, time=0.5), same("drum", slip=1e-6, eccentricity=0.02, phase=1.0)),
    (same("slack", softness=300.0), same("hysteresis", force=60.0, yield_strain=1e-4)),
    (same("sag", linear_density=0.4), same("pulley", radius=0.15), same("friction", coefficient=0.05)),
    (same("thermal", rise=10.0, expansion=1.2e-5, time=20.0), same("damping", damping=1.7e9)),
    (same("payload", mass=20.0), same("drag", drag_area=5.0)),
)
# Several that act in all stages of a cable and on the platform, and what makes the sensors lag.
SEVERAL = (
    same("damping", damping=1.7e9),
    same("sag", linear_density=0.1),
    same("pulley", radius=0.15),
    same("drum", eccentricity=0.02, phase=1.0, radius=0.15),
    same("friction", coefficient=0.05),
    same("transverse_damping", damping=40.0),
    Case("relaxation", {}, BRANCHES),
    same("payload", mass=20.0),
    Case("drag", {}, {"drag_area": 5.0, "wind_x": 2.0}),
)
DELAYED = same("sensor_delay", tension_delay=0.023, position_delay=0.05)
