"""FMI variables of a cable, in the order in which the slave keeps their values."""

from typing import Any, Dict, Optional, Tuple

from .effect_variables import effect_state_variables, effect_variables, effects_from_resource
from .model_description import Variable, axis_names, vector_variables
from .slave import INPUT_TIME, MIDDLE_TIME

MOTION_INPUTS = (*axis_names("position", "velocity"), "winch_speed")
MOTION_AND_RATE_INPUTS = (*MOTION_INPUTS, *axis_names("acceleration"), "winch_acceleration")


def cable_variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Inputs, outputs, their rates, states, parameters; ``data`` is the cable's resource."""
    return (*_inputs(data), *_outputs(data), *_states(data), *_parameters(data))


def _inputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    start, length = tuple(data["start"]), float(data["start_length"])
    return (
        INPUT_TIME,
        MIDDLE_TIME,
        *vector_variables(
            Variable("position", "input", "m", "position of the cable's end on the platform", nominal=length), start
        ),
        *vector_variables(Variable("velocity", "input", "m/s", "velocity of the platform, the rate of position")),
        *vector_variables(
            Variable("acceleration", "input", "m/s2", "acceleration of the platform, the rate of velocity")
        ),
        Variable("winch_speed", "input", "m/s", "rope speed by the winch encoder, positive reels in"),
        Variable("winch_acceleration", "input", "m/s2", "rate of winch_speed"),
        *vector_variables(
            Variable("middle_position", "input", "m", "position in the middle of a step", nominal=length), start
        ),
        *vector_variables(Variable("middle_velocity", "input", "m/s", "velocity in the middle of a step")),
        *vector_variables(Variable("middle_acceleration", "input", "m/s2", "acceleration in the middle of a step")),
    )


def _outputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    # A nominal value is never zero.
    tension, length = float(data["start_tension"]) or None, float(data["start_length"])
    load_cell_text = "tension at the load cell, between winch and exit point"
    length_text = "rope from exit point to platform, as if it did not sag"
    # A load cell with a zero of its own may show less than none.
    minimum = None if any(effect.name == "sensor_offset" for effect in effects_from_resource(data)) else 0.0
    elongation_text = "length less start length and rope let out"
    pull_text = "tension that the law asks for, negative where the cable hangs slack"
    position_inputs = axis_names("position")
    return (
        *vector_variables(
            Variable("force", "output", "N", "force on the platform", nominal=tension, depends_on=MOTION_INPUTS)
        ),
        Variable("tension", "output", "N", load_cell_text, minimum=minimum, nominal=tension, depends_on=MOTION_INPUTS),
        Variable("length", "output", "m", length_text, nominal=length, depends_on=position_inputs),
        Variable("elongation", "output", "m", elongation_text, depends_on=position_inputs),
        Variable("strain", "output", "1", "strain by the tension law", nominal=1e-3, depends_on=position_inputs),
        Variable("pull", "output", "N", pull_text, nominal=tension, depends_on=MOTION_INPUTS),
        *_rate_and_middle_outputs(tension),
    )


def _rate_and_middle_outputs(tension: Optional[float]) -> Tuple[Variable, ...]:
    return (
        *vector_variables(
            Variable(
                "force_rate",
                "output",
                "N/s",
                "rate of force",
                nominal=tension,
                depends_on=MOTION_AND_RATE_INPUTS,
                rate_of="force",
            )
        ),
        Variable(
            "tension_rate",
            "output",
            "N/s",
            "rate of tension",
            nominal=tension,
            depends_on=MOTION_AND_RATE_INPUTS,
            rate_of="tension",
        ),
        *vector_variables(
            Variable("middle_force", "output", "N", "force in the middle of the last step", nominal=tension)
        ),
        *vector_variables(
            Variable(
                "middle_force_rate", "output", "N/s", "rate of force there", nominal=tension, rate_of="middle_force"
            )
        ),
    )


def _states(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    length = float(data["start_length"])
    return (
        Variable("unstrained_length", "local", "m", "state: rope in the span if it were unloaded", nominal=length),
        Variable("wound_length", "local", "m", "state: rope reeled in since the start", nominal=length),
        *effect_state_variables(data),
    )


def _parameters(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    anchor, start = tuple(data["anchor"]), tuple(data["start"])
    area_text = "area that the modulus refers to"
    return (
        *vector_variables(Variable("anchor", "parameter", "m", "exit point on the frame"), anchor),
        *vector_variables(
            Variable("start", "parameter", "m", "position of the platform at the start, in static equilibrium"), start
        ),
        Variable("modulus", "parameter", "Pa", "modulus of elasticity", data["modulus"], True, 0.0, nominal=1e11),
        Variable("area", "parameter", "m2", area_text, data["area"], True, 0.0, nominal=1e-5),
        Variable("damping", "parameter", "Pa s", "viscosity of the rope", data["damping"], True, 0.0, nominal=1e9),
        Variable(
            "start_tension",
            "parameter",
            "N",
            "tension at the start",
            float(data["start_tension"]),
            minimum=0.0,
            nominal=1e3,
        ),
        Variable("gravity", "parameter", "m/s2", "gravity, along -z", float(data["gravity"]), True),
        *effect_variables(data["effects"]),
    )
