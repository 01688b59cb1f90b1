"""FMI variables of a rigid platform, in the order in which the slave keeps their values."""

from typing import Any, Dict, Sequence, Tuple

from .effect_variables import effect_state_variables, effect_variables
from .model_description import Variable, axis_names, vector_variables
from .platform_variables import MIDDLE_TEXT, force_variables, mass_parameters, measured_position_variables
from .slave import INPUT_TIME, MIDDLE_TIME

INERTIA_ENTRIES = ("xx", "yy", "zz", "xy", "xz", "yz")


def rigid_body_variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Inputs, outputs, states, parameters; ``data`` is the platform's resource."""
    return (*_inputs(data), *_outputs(data), *_states(data), *_parameters(data))


def attachment_suffixes(data: Dict[str, Any]) -> Tuple[str, ...]:
    """``_1`` and so on, one for each cable."""
    return tuple(f"_{number}" for number in range(1, len(data["attachments"]) + 1))


def _inputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    moment = Variable("external_moment", "input", "N m", "external moment, in the axes of the world")
    rate = Variable("external_moment_rate", "input", "N m/s", "rate of the external moment")
    return (INPUT_TIME, MIDDLE_TIME, *vector_variables(moment), *vector_variables(rate), *force_variables(data))


def _outputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    loads = axis_names(*(f"force{suffix}" for suffix in attachment_suffixes(data)), "external_force", "external_moment")
    velocity = Variable("angular_velocity", "output", "rad/s", "angular velocity, in the axes of the world")
    acceleration = Variable(
        "angular_acceleration",
        "output",
        "rad/s2",
        "angular acceleration, in the axes of the world",
        depends_on=loads,
        rate_of="angular_velocity",
    )
    starts = data["start_attachments"]
    attachments = [
        (suffix, f"attachment of cable {suffix[1:]}", start) for suffix, start in zip(attachment_suffixes(data), starts)
    ]
    at_end, in_middle = "{}".format, MIDDLE_TEXT.format
    return (
        *_motion("", "", data["start"], data, "origin of the platform's frame", at_end, loads),
        *(v for end, point, start in attachments for v in _motion("", end, start, data, point, at_end, loads)),
        *vector_variables(velocity),
        *vector_variables(acceleration),
        *(v for end, point, start in attachments for v in _motion("middle_", end, start, data, point, in_middle)),
        *measured_position_variables(data),
    )


def _motion(
    prefix: str,
    suffix: str,
    start: Sequence[float],
    data: Dict[str, Any],
    point: str,
    text: Any,
    loads: Tuple[str, ...] = (),
) -> Tuple[Variable, ...]:
    """Position, velocity and acceleration of a point."""
    position, velocity, acceleration = (f"{prefix}{name}{suffix}" for name in ("position", "velocity", "acceleration"))
    x, y, z = start
    return (
        *vector_variables(Variable(position, "output", "m", text(f"position of the {point}")), (x, y, z)),
        *vector_variables(Variable(velocity, "output", "m/s", text(f"velocity of the {point}"), rate_of=position)),
        *vector_variables(
            Variable(
                acceleration,
                "output",
                "m/s2",
                text(f"acceleration of the {point}"),
                nominal=float(data["gravity"]) or None,
                depends_on=loads,
                rate_of=velocity,
            )
        ),
    )


def _states(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """The orientation, which is an output too, and the other states, which are local."""
    orientation = Variable("orientation", "output", "1", "unit quaternion, platform to world")
    states = (
        Variable("mass_position", "local", "m", "state: position of the centre of mass"),
        Variable("mass_velocity", "local", "m/s", "state: velocity of the centre of mass"),
        Variable(
            "angular_momentum", "local", "N m s", "state: angular momentum about the centre of mass, world's axes"
        ),
    )
    return (
        *_quaternion_variables(orientation, data["start_orientation"]),
        *(component for state in states for component in vector_variables(state)),
        *effect_state_variables(data),
    )


def _quaternion_variables(quaternion: Variable, start: Sequence[float]) -> Tuple[Variable, ...]:
    return tuple(
        quaternion._replace(
            name=f"{quaternion.name}.{part}", description=f"{quaternion.description}, {part} part", start=value
        )
        for part, value in zip("wxyz", start)
    )


def _parameters(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    x, y, z = data["centre_of_mass"]
    centre = Variable("centre_of_mass", "parameter", "m", "centre of mass in the platform's frame", tunable=True)
    orientation = Variable(
        "start_orientation", "parameter", "1", "unit quaternion at the start", minimum=-1.0, maximum=1.0
    )
    return (
        *mass_parameters(data),
        *_quaternion_variables(orientation, data["start_orientation"]),
        *_inertia_parameters(data),
        *vector_variables(centre, (x, y, z)),
        *(
            variable
            for suffix, (bx, by, bz) in zip(attachment_suffixes(data), data["attachments"])
            for variable in vector_variables(
                Variable(
                    f"attachment{suffix}", "parameter", "m", f"attachment of cable {suffix[1:]} in the platform's frame"
                ),
                (bx, by, bz),
            )
        ),
        *effect_variables(data["effects"]),
    )


def _inertia_parameters(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    matrix = data["inertia"]
    size = max(matrix[axis][axis] for axis in range(3))
    return tuple(
        Variable(
            f"inertia.{entry}",
            "parameter",
            "kg m2",
            f"inertia about the centre of mass in the platform's axes, entry {entry}",
            matrix["xyz".index(entry[0])]["xyz".index(entry[1])],
            True,
            minimum=0.0 if entry[0] == entry[1] else None,
            nominal=size,
        )
        for entry in INERTIA_ENTRIES
    )
