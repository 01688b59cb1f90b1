"""FMI slave of the point-mass platform: cable forces in, motion out."""

from typing import Any, Dict, Tuple

from .effect_variables import effect_state_variables, effect_variables
from .hermite_quadrature import MotionState
from .laws.vectors import Vector
from .model_description import Variable, axis_names, vector_variables
from .platform_slave import PlatformSlave
from .platform_variables import MIDDLE_TEXT, force_variables, mass_parameters, measured_position_variables
from .slave import INPUT_TIME, MIDDLE_TIME, read_resource


class PointMass(PlatformSlave):
    """Point mass under the forces of its cables, an external force and its weight."""

    first_force = 2
    first_effect_parameter = 5

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "point_mass.json")
        variables = _variables(data)
        self.first_output = [variable.name for variable in variables].index("position.x")
        self.measured_position_index = self.first_output + 18
        # Among the effects only formulas have states on the platform: the time since the start.
        self.time_index = self.first_output + 18 + len(measured_position_variables(data))
        self.start_velocity: Tuple[float, ...] = tuple(data.get("start_velocity", (0.0, 0.0, 0.0)))
        self.end_acceleration: Vector = ()
        super().__init__(data, variables, slice(self.first_output, self.first_output + 6), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        super().parameters_changed()
        if not self.started:
            start = self.real[self.first_parameter + 2 : self.first_parameter + 5]
            self.real[self.first_output : self.first_output + 6] = [*start, *self.start_velocity]

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Integrate position and velocity over one step."""
        first = self.first_output
        start = MotionState(self.real[first : first + 3], self.real[first + 3 : first + 6], ())
        nodes, middle, end = self.translate(start, step, inputs_at_end)
        if self.position_delay > 0.0:
            self.record_path(step, start._replace(acceleration=nodes[0].acceleration), end)
        self.end_acceleration = end.acceleration
        self.real[first : first + 6] = [*end.position, *end.velocity]
        self.real[first + 9 : first + 18] = [*middle.position, *middle.velocity, *middle.acceleration]

    def refresh(self) -> None:
        first = self.first_output
        at_step_end = self.inputs_unchanged and not self.has_motion_dependent_force
        self.real[first + 6 : first + 9] = (
            self.end_acceleration
            if at_step_end
            else self.present_acceleration(self.real[first : first + 3], self.real[first + 3 : first + 6])
        )
        if not self.started:
            self.real[first + 9 : first + 18] = self.real[first : first + 9]
        if self.has_position_sensor:
            self.refresh_measured_position(self.real[first : first + 3])


def _variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    return (
        INPUT_TIME,
        MIDDLE_TIME,
        *force_variables(data),
        *_motion_outputs(data),
        *effect_state_variables(data),
        *mass_parameters(data),
        *effect_variables(data["effects"]),
    )


def _motion_outputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Motion at the end of a step and in its middle, and the measured position if a sensor distorts it."""
    start, gravity = tuple(data["start"]), float(data["gravity"]) or None
    forces = axis_names(*(f"force_{number}" for number in range(1, len(data["start_forces"]) + 1)), "external_force")
    position = Variable("position", "output", "m", "position of the point mass")
    velocity = Variable("velocity", "output", "m/s", "velocity of the point mass", rate_of="position")
    acceleration = Variable(
        "acceleration",
        "output",
        "m/s2",
        "acceleration of the point mass",
        nominal=gravity,
        depends_on=forces,
        rate_of="velocity",
    )
    text = MIDDLE_TEXT.format
    middle_position = Variable("middle_position", "output", "m", text("position"))
    middle_velocity = Variable("middle_velocity", "output", "m/s", text("velocity"), rate_of="middle_position")
    middle_acceleration = Variable(
        "middle_acceleration", "output", "m/s2", text("acceleration"), nominal=gravity, rate_of="middle_velocity"
    )
    return (
        *vector_variables(position, start),
        *vector_variables(velocity),
        *vector_variables(acceleration),
        *vector_variables(middle_position, start),
        *vector_variables(middle_velocity),
        *vector_variables(middle_acceleration),
        *measured_position_variables(data),
    )
