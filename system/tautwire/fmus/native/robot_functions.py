"""Functions of a native whole robot: those of its components, put so that all states have rates at one instant.

A load is the forces of all cables, the external force, and on a platform that turns the external moment; an end is
position and velocity of a cable at the platform.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from tautwire_fmu.effect_variables import effects_from_resource
from tautwire_fmu.laws import rigid_body as law
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.rotation import quaternion_rate, rotation_matrix
from tautwire_fmu.rotation_quadrature import ORIGIN

from .cable_functions import END_SIZE, whole_robot_cable_functions
from .interpolation_functions import quintic_function
from .platform_functions import POINT_MASS_PARAMETERS, SENSOR_SIZE, Mass
from .rigid_body_functions import AXES_SIZE, START_MOTION_SIZE, RigidBody, start_size
from .traced_functions import Columns, TracedFunction, trace_derivative, trace_function
from .winch_functions import winch_functions

POINT_SIZE = 9
MASS_SIZE = 6


def robot_functions(data: Mapping[str, Any]) -> tuple[TracedFunction, ...]:
    """Functions of a whole robot's resource: of each kind of cable, of the platform, and of winches."""
    kinds, _ = cable_kinds(data["cables"])
    return (
        *(function for kind, cable in enumerate(kinds) for function in whole_robot_cable_functions(cable, kind)),
        *_platform_functions(data),
        *(winch_functions() if data["winches"] else ()),
        quintic_function(),
    )


def cable_kinds(cables: Sequence[Mapping[str, Any]]) -> tuple[list[Mapping[str, Any]], list[int]]:
    """Cables of distinct equations, and of each cable which of them it follows."""
    structures = [cable_structure(cable) for cable in cables]
    texts = [json.dumps(each, sort_keys=True) for each in structures]
    distinct = list(dict.fromkeys(texts))
    return [structures[texts.index(text)] for text in distinct], [distinct.index(text) for text in texts]


def cable_structure(cable: Mapping[str, Any]) -> dict[str, Any]:
    """What the equations of a cable depend on."""
    effects = [{"name": effect["name"]} for effect in cable["effects"]]
    return {"law": cable["law"], "swivel_axis": cable["swivel_axis"], "effects": effects, "formulas": cable["formulas"]}


def robot_structure(data: Mapping[str, Any]) -> dict[str, Any]:
    """What the equations of a whole robot depend on."""
    platform = data["platform"]
    effects = [{name: effect[name] for name in ("name", "cable") if name in effect} for effect in platform["effects"]]
    attachments = [None for _ in platform.get("attachments", ())]
    return {
        "is_rigid": data["is_rigid"],
        "platform": {"effects": effects, "formulas": platform["formulas"], "attachments": attachments},
        "cables": [cable_structure(cable) for cable in data["cables"]],
        "winches": [None for _ in data["winches"]],
    }


def platform_start_size(data: Mapping[str, Any]) -> int:
    """Numbers that follow from the platform's parameters, those of its sensor first."""
    return start_size(len(data["cables"])) if data["is_rigid"] else SENSOR_SIZE


def _platform_functions(data: Mapping[str, Any]) -> tuple[TracedFunction, ...]:
    platform = (_RigidBody if data["is_rigid"] else _PointMass)(data)
    parameters, states = {"parameters": platform.parameter_count}, {"states": platform.state_count}
    start, load = {"start": platform_start_size(data)}, {"load": platform.load_size}
    loaded = {**states, **load, **parameters, **start}
    at_start = {**parameters, "principal_axes": AXES_SIZE, "motion": START_MOTION_SIZE}
    return (
        trace_function("platform_start", at_start, platform.start_with_time),
        trace_function("platform_ends", {**states, **start}, platform.ends),
        trace_function("platform_rates", loaded, platform.rates),
        trace_function("platform_motion", loaded, platform.motion),
        trace_derivative("platform_derivative", loaded, platform.motion, ("load",)),
    )


class _Platform:
    """What platforms of both kinds share; a formula with the time has it as the last state."""

    state_size: int
    load_size: int

    def __init__(self, data: Mapping[str, Any], first_effect_parameter: int) -> None:
        effects = effects_from_resource(dict(data["platform"]))
        self.mass = Mass(effects, first_effect_parameter)
        self.count = len(data["cables"])
        self.has_time = any(effect.states for effect in effects)
        self.state_count = self.state_size + self.has_time

    def start_with_time(self, m: Mathematics, columns: Columns) -> Columns:
        """What follows from the parameters, and all states at the start."""
        result = self.start(m, columns)
        return {"start": result["start"], "states": [*result["states"], *([0.0] if self.has_time else [])]}

    def start(self, m: Mathematics, columns: Columns) -> Columns:
        """As :meth:`start_with_time`, without the time."""
        raise NotImplementedError

    def acceleration(self, m: Mathematics, columns: Columns, mass: Sequence[Any]) -> Sequence[Any]:
        """Acceleration of the mass, by its position and velocity, under the load."""
        force = [sum(columns["load"][axis : 3 * (self.count + 1) : 3]) for axis in range(3)]
        time = columns["states"][-1] if self.has_time else 0.0
        return self.mass.acceleration_under(m, columns["parameters"], mass, force, time)

    def time_rate(self) -> list[float]:
        """Rate of the time, where there is one."""
        return [1.0] if self.has_time else []


class _PointMass(_Platform):
    """States: position and velocity."""

    state_size = MASS_SIZE

    def __init__(self, data: Mapping[str, Any]) -> None:
        super().__init__(data, POINT_MASS_PARAMETERS)
        effects = self.mass.listed_effects
        self.parameter_count = POINT_MASS_PARAMETERS + sum(len(effect.parameters) for effect in effects)
        self.load_size = 3 * (self.count + 1)

    def start(self, m: Mathematics, columns: Columns) -> Columns:
        """Gain, offset and delay of the measured position; the states."""
        sensor = self.mass.sensor(m, columns)["sensor"]
        return {"start": sensor, "states": [*columns["parameters"][2:5], *columns["motion"][:3]]}

    def ends(self, m: Mathematics, columns: Columns) -> Columns:
        """All cables hold the one point."""
        return {"ends": [*columns["states"][:MASS_SIZE]] * self.count}

    def rates(self, m: Mathematics, columns: Columns) -> Columns:
        """Rates of the states under a load."""
        mass = columns["states"][:MASS_SIZE]
        return {"rates": [*mass[3:], *self.acceleration(m, columns, mass), *self.time_rate()]}

    def motion(self, m: Mathematics, columns: Columns) -> Columns:
        """Position, velocity and acceleration under a load, of the platform and of each end."""
        mass = columns["states"][:MASS_SIZE]
        point = [*mass, *self.acceleration(m, columns, mass)]
        return {"shown": point, "ends": point * self.count}


class _RigidBody(_Platform):
    """States: quaternion, position and velocity of the centre of mass, angular momentum about it."""

    state_size = 13

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.body = WholeRobotBody(data["platform"])
        super().__init__(data, self.body.first_effect_parameter)
        self.parameter_count = self.body.parameter_count
        self.load_size = 3 * (self.count + 2)

    def start(self, m: Mathematics, columns: Columns) -> Columns:
        """Those of the component."""
        return self.body.start(m, columns)

    def ends(self, m: Mathematics, columns: Columns) -> Columns:
        """Ends of the cables."""
        points = self.body.motion_of_points(m, columns, [*columns["states"][4:10], *ORIGIN])
        return {"ends": [entry for k in range(self.count) for entry in points[9 * k + 9 : 9 * k + 9 + END_SIZE]]}

    def rates(self, m: Mathematics, columns: Columns) -> Columns:
        """Rates of the states under a load."""
        mass, turning = columns["states"][4:10], self.body.turning_rates(m, columns)
        acceleration = self.acceleration(m, columns, mass)
        return {"rates": [*turning[:4], *mass[3:], *acceleration, *turning[4:], *self.time_rate()]}

    def motion(self, m: Mathematics, columns: Columns) -> Columns:
        """Motion of the origin under a load, the angular velocity and acceleration, and the motion of each end."""
        mass = columns["states"][4:10]
        points = self.body.motion_of_points(m, columns, [*mass, *self.acceleration(m, columns, mass)])
        first_turning = POINT_SIZE * (1 + self.count)
        return {"shown": [*points[:POINT_SIZE], *points[first_turning:]], "ends": points[POINT_SIZE:first_turning]}


class WholeRobotBody(RigidBody):
    """The equations of a rigid platform, on the states and the load of a whole robot."""

    def turning_rates(self, m: Mathematics, columns: Columns) -> list[Any]:
        """Rates of the quaternion and of the angular momentum under a load."""
        quaternion, momentum = columns["states"][:4], columns["states"][10:13]
        rotation = rotation_matrix(quaternion)
        velocity = law.angular_velocity(self._inertia(columns), rotation, momentum)
        moment = self._moment(m, columns, rotation, velocity, self._load(columns))
        return [*quaternion_rate(quaternion, velocity), *moment]

    def motion_of_points(self, m: Mathematics, columns: Columns, mass: Sequence[Any]) -> list[Any]:
        """Points as :meth:`points` has them, under the load if there is one."""
        quaternion, momentum = columns["states"][:4], columns["states"][10:13]
        if "load" in columns:
            attitude = self._attitude(m, columns, quaternion, momentum, self._load(columns))
        else:
            attitude = self._attitude_under(columns, rotation_matrix(quaternion), momentum, ORIGIN)
        return list(self.points(m, {**columns, "attitude": attitude, "mass": mass})["points"])

    def _load(self, columns: Columns) -> list[Any]:
        """The load as the component has it, its rates zero; the external force acts at the origin."""
        numbers, load = columns["start"][SENSOR_SIZE:], columns["load"]
        arms = [numbers[3 * k : 3 * k + 3] for k in (*range(1, self.cable_count + 1), 0)]
        forces = [load[3 * k : 3 * k + 3] for k in range(self.cable_count + 1)]
        matrix = law.moment_matrix(tuple(zip(*arms, strict=True)), tuple(zip(*forces, strict=True)))
        rows = [entry for row in matrix for entry in row]
        return [*rows, *[0.0] * 9, *load[3 * (self.cable_count + 1) :], *ORIGIN]
