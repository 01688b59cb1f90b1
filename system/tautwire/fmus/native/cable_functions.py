"""Functions of a native cable: its start, the rates of its states, and its outputs with their rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tautwire_fmu.effect_variables import active_effects, effects_from_resource
from tautwire_fmu.laws import cable as law
from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effects import ActiveEffect, Effect
from tautwire_fmu.laws.mathematics import Mathematics

from .interpolation_functions import MOTION_SIZE
from .traced_functions import (
    INDICATORS,
    Columns,
    TracedFunction,
    rates_along,
    trace_derivative,
    trace_function,
    trace_kinks,
)

DECLARED_PARAMETERS = 11
START_SIZE = 7
# Position and velocity of a cable's end.
END_SIZE = 6


def cable_functions(data: Mapping[str, Any]) -> tuple[TracedFunction, ...]:
    """``cable_start``, ``cable_rates``, ``cable_outputs``, ``cable_derivative`` and ``cable_indicators`` of a resource.

    ``start`` are what follows from the parameters: length, direction, sensor delay, whether effects' states
    move, and tension at the load cell behind a filter. The derivative is that of outputs and rates.
    """
    cable = _Cable(data)
    known, varying = {"motion": MOTION_SIZE, **cable.known}, ("motion", "states")
    return (
        *cable.shared_functions(),
        trace_function("cable_rates", known, cable.rates),
        trace_derivative("cable_derivative", known, cable.outputs_and_rates, varying),
        trace_kinks("cable_indicators", known, cable.kinks, varying),
    )


def whole_robot_cable_functions(data: Mapping[str, Any], kind: int) -> tuple[TracedFunction, ...]:
    """As :func:`cable_functions`, with the number of the ``kind`` behind the names.

    In place of the rates there is ``cable_action``: rates of the states, and the force on the platform. The derivative
    is that of the outputs, with the states held.
    """
    cable, suffix = _Cable(data), f"_{kind}"
    motion = {"motion": MOTION_SIZE, **cable.known}
    return (
        *cable.shared_functions(suffix),
        trace_function(f"cable_action{suffix}", {"end": END_SIZE, "speed": 1, **cable.known}, cable.action),
        trace_derivative(f"cable_derivative{suffix}", motion, cable.outputs, ("motion",)),
    )


class _Cable:
    """Equations of a cable as functions of its columns."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.listed_effects: Sequence[Effect] = effects_from_resource(dict(data))
        self.tension_law = law.LAWS[data["law"]]
        self.swivel_axis = tuple(data["swivel_axis"])
        states = 2 + sum(len(effect.states) for effect in self.listed_effects)
        parameters = DECLARED_PARAMETERS + sum(len(effect.parameters) for effect in self.listed_effects)
        self.known = {"states": states, "parameters": parameters, "start": START_SIZE}

    def shared_functions(self, suffix: str = "") -> tuple[TracedFunction, ...]:
        """Functions of any cable, with a suffix behind their names."""
        motion = {"motion": MOTION_SIZE, **self.known}
        return (
            trace_function(f"cable_start{suffix}", {"parameters": self.known["parameters"]}, self.start),
            trace_function(f"cable_outputs{suffix}", motion, self.outputs),
        )

    def start(self, m: Mathematics, columns: Columns) -> Columns:
        """What follows from the parameters, see :func:`cable_functions`, and the states at the start."""
        parameters = columns["parameters"]
        effects = active_effects(self.listed_effects, parameters[DECLARED_PARAMETERS:])
        route = stages.route(m, effects, parameters[0:3], parameters[3:6], self.swivel_axis)
        start = [
            route.length,
            *route.direction,
            stages.sensor_delays(m, effects)[0],
            stages.moves_states(m, effects),
            0.0,
        ]
        constants, effects = self._constants(m, parameters, start)
        start[-1] = law.with_start_cell_tension(m, constants, effects, route.chord).start_cell_tension
        return {"start": start, "states": _flat_state(law.start_state(constants, effects))}

    def rates(self, m: Mathematics, columns: Columns) -> Columns:
        """Rates of the states."""
        constants, effects = self._constants(m, columns["parameters"], columns["start"])
        state, inputs = _state(effects, columns["states"]), _inputs(columns["motion"])
        line = law.span(m, constants, inputs, effects)
        motion = law.cable_motion(m, constants, effects, state, line, inputs.winch_speed)
        return {"rates": _flat_state(law.state_rates(m, constants, effects, state, motion))}

    def action(self, m: Mathematics, columns: Columns) -> Columns:
        """Rates of the states, and the force on the platform."""
        constants, effects = self._constants(m, columns["parameters"], columns["start"])
        end, speed, state = columns["end"], columns["speed"][0], _state(effects, columns["states"])
        line = law.span(m, constants, law.CableInputs(end[:3], end[3:], speed), effects)
        motion = law.cable_motion(m, constants, effects, state, line, speed)
        rates = law.state_rates(m, constants, effects, state, motion)
        return {"rates": _flat_state(rates), "force": law.cable_outputs(m, constants, effects, state, motion).force}

    def outputs(self, m: Mathematics, columns: Columns) -> Columns:
        """Outputs in the order of the FMU's variables, then the rates of force and tension."""
        constants, effects = self._constants(m, columns["parameters"], columns["start"])
        state, inputs = _state(effects, columns["states"]), _inputs(columns["motion"])
        line = law.span(m, constants, inputs, effects)
        motion = law.cable_motion(m, constants, effects, state, line, inputs.winch_speed)
        state_rates = _flat_state(law.state_rates(m, constants, effects, state, motion))
        shown = law.cable_outputs(m, constants, effects, state, motion)
        varying = [*columns["motion"][:6], columns["motion"][9], *columns["states"]]
        varying_rates = [*columns["motion"][3:9], columns["motion"][10], *state_rates]
        return {
            "outputs": [*shown.force, shown.tension, shown.length, shown.elongation, shown.strain, shown.pull],
            "output_rates": rates_along([*shown.force, shown.tension], varying, varying_rates),
        }

    def outputs_and_rates(self, m: Mathematics, columns: Columns) -> Columns:
        """All outputs, then the rates of the states."""
        return {**self.outputs(m, columns), **self.rates(m, columns)}

    def kinks(self, m: Mathematics, columns: Columns) -> Columns:
        """The pull, at whose zeros the cable falls slack or becomes taut; tracing finds all other kinks."""
        return {INDICATORS: self.outputs(m, columns)["outputs"][-1:]}

    def _constants(
        self, m: Mathematics, parameters: Sequence[Any], start: Sequence[Any]
    ) -> tuple[law.CableConstants, tuple[ActiveEffect, ...]]:
        modulus, area, damping, start_tension, gravity = parameters[6:DECLARED_PARAMETERS]
        declared = law.CableConstants(
            law=self.tension_law,
            anchor=parameters[0:3],
            modulus=modulus,
            area=area,
            damping=damping,
            start_length=start[0],
            start_tension=start_tension,
            start_direction=start[1:4],
            gravity=gravity,
            swivel_axis=self.swivel_axis,
            start_cell_tension=start[6],
        )
        effects = active_effects(self.listed_effects, parameters[DECLARED_PARAMETERS:])
        return law.fold_constant_effects(m, declared, effects)


def _inputs(motion: Sequence[Any]) -> law.CableInputs:
    return law.CableInputs(motion[0:3], motion[3:6], motion[9])


def _state(effects: Sequence[ActiveEffect], states: Sequence[Any]) -> law.CableState:
    effect_states = []
    first = 2
    for active in effects:
        count = len(active.effect.states)
        effect_states.append(tuple(states[first : first + count]))
        first += count
    return law.CableState(states[0], states[1], tuple(effect_states))


def _flat_state(state: law.CableState) -> list[Any]:
    return [state.unstrained_length, state.wound_length, *(each for own in state.effects for each in own)]
