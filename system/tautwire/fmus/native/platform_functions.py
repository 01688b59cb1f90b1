"""Functions of a native platform: its sensor, and the acceleration of its mass with its rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tautwire_fmu.effect_variables import active_effects, effects_from_resource
from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import point_mass as law
from tautwire_fmu.laws.effects import Effect
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.vectors import Vector, add

from .traced_functions import Columns, TracedFunction, rates_along, trace_derivative, trace_function, trace_kinks

POINT_MASS_PARAMETERS = 5
SENSOR_SIZE = 5


def mass_functions(data: Mapping[str, Any], first_effect_parameter: int) -> tuple[TracedFunction, ...]:
    """``platform_sensor``, ``platform_node``, ``platform_derivative`` and ``platform_indicators`` of a resource.

    ``first_effect_parameter`` parameters come before those of the effects, mass and gravity first. ``sensor`` is gain,
    offset and delay of the measured position; a node the acceleration of the mass and its rate; the derivative that of
    the acceleration with respect to motion, force and time.
    """
    effects = effects_from_resource(dict(data))
    parameters = first_effect_parameter + sum(len(effect.parameters) for effect in effects)
    mass = Mass(effects, first_effect_parameter)
    known = {"mass": 6, "force_and_rate": 6, "time": 1, "parameters": parameters}
    varying = ("mass", "force_and_rate", "time")
    return (
        trace_function("platform_sensor", {"parameters": parameters}, mass.sensor),
        trace_function("platform_node", known, mass.node),
        trace_derivative("platform_derivative", known, mass.acceleration, varying),
        trace_kinks("platform_indicators", known, mass.acceleration, varying),
    )


class Mass:
    """Equations of a platform's mass as functions of its columns."""

    def __init__(self, effects: Sequence[Effect], first_effect_parameter: int) -> None:
        self.listed_effects = effects
        self.first_effect_parameter = first_effect_parameter

    def sensor(self, m: Mathematics, columns: Columns) -> Columns:
        """Gain, offset and delay of the measured position."""
        effects = active_effects(self.listed_effects, columns["parameters"][self.first_effect_parameter :])
        gain, offset, delay = (
            each(m, effects)[1] for each in (stages.sensor_gains, stages.sensor_offsets, stages.sensor_delays)
        )
        return {"sensor": [gain, *offset, delay]}

    def acceleration(self, m: Mathematics, columns: Columns) -> Columns:
        """Acceleration under a force."""
        return {"acceleration": self.node(m, columns)["node"][:3]}

    def node(self, m: Mathematics, columns: Columns) -> Columns:
        """Acceleration under a force, and its rate where position, velocity, force and time change at theirs."""
        time, mass, force_and_rate = columns["time"][0], columns["mass"], columns["force_and_rate"]
        acceleration = self.acceleration_under(m, columns["parameters"], mass, force_and_rate[:3], time)
        varying = [*mass, *force_and_rate[:3], time]
        rates = [*mass[3:], *acceleration, *force_and_rate[3:], 1.0]
        return {"node": [*acceleration, *rates_along(acceleration, varying, rates)]}

    def acceleration_under(
        self, m: Mathematics, parameters: Sequence[Any], mass: Sequence[Any], force: Vector, time: Any
    ) -> Vector:
        """Acceleration of the mass, by its position and velocity, under the forces of cables and from outside."""
        effects = active_effects(self.listed_effects, parameters[self.first_effect_parameter :])
        constants = law.PointMassConstants(mass=parameters[0], gravity=parameters[1])
        states = [(time,) if active.effect.states else () for active in effects]
        total_force = add(force, law.wrench(m, effects, states, mass[:3], mass[3:]))
        return law.acceleration(m, constants, effects, states, total_force)
