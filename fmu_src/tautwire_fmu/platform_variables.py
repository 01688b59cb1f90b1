"""FMI variables that the platforms of all kinds share."""

from typing import Any, Dict, List, Optional, Tuple

from .effect_variables import effects_from_resource
from .model_description import Variable, vector_variables

MIDDLE_TEXT = "{} in the middle of the last step"


def has_position_sensor(data: Dict[str, Any]) -> bool:
    """Whether some effect makes the measured position differ from the true one."""
    return any(effect.component == "sensor" for effect in effects_from_resource(data))


def force_variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Forces and their rates at the end of a step, then those of the cables in its middle."""
    # A nominal value is never zero, as the weight of a platform on a table would be.
    weight = float(data["mass"]) * float(data["gravity"]) or None
    cable_forces = tuple(
        (f"_{number}", f"force of cable {number}", tuple(force))
        for number, force in enumerate(data["start_forces"], start=1)
    )
    variables: List[Variable] = []
    for number, description, force in cable_forces:
        variables += _force_inputs(f"force{number}", f"force_rate{number}", description, force, weight)
    variables += _force_inputs("external_force", "external_force_rate", "external force", (0.0, 0.0, 0.0), weight)
    for number, description, force in cable_forces:
        middle_description = f"{description} in the middle of a step"
        variables += _force_inputs(
            f"middle_force{number}", f"middle_force_rate{number}", middle_description, force, weight
        )
    return tuple(variables)


def _force_inputs(
    name: str, rate_name: str, description: str, start: Tuple[float, float, float], weight: Optional[float]
) -> Tuple[Variable, ...]:
    return (
        *vector_variables(Variable(name, "input", "N", description, nominal=weight), start),
        *vector_variables(Variable(rate_name, "input", "N/s", f"rate of the {description}", nominal=weight)),
    )


def mass_parameters(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Mass, gravity and the start position."""
    start = tuple(data["start"])
    return (
        Variable("mass", "parameter", "kg", "mass of the platform", data["mass"], True, 0.0, nominal=data["mass"]),
        Variable("gravity", "parameter", "m/s2", "gravity, along -z", data["gravity"], True),
        *vector_variables(Variable("start", "parameter", "m", "position at the start, at rest"), start),
    )


def measured_position_variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """The position as its sensor shows it, if one distorts it."""
    measured_position = Variable("measured_position", "output", "m", "position as its sensor shows it")
    return vector_variables(measured_position, tuple(data["start"])) if has_position_sensor(data) else ()
