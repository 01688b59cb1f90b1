"""FMI slave of the point-mass platform: cable forces in, motion out."""

from typing import Any, Dict, List, Sequence, Tuple

from .delay_line import SignalSample, append_segment, delayed_value
from .effect_variables import active_effects, effect_state_variables, effect_variables, effects_from_resource
from .hermite_quadrature import (
    CUBIC_END,
    CUBIC_MIDDLE,
    QUINTIC_END,
    QUINTIC_MIDDLE,
    AccelerationNode,
    MotionState,
    cubic_hermite,
    integrate_hermite,
)
from .laws import effect_stages as stages
from .laws import point_mass as law
from .laws.effects import Effect
from .laws.mathematics import COMPLEX_STEP, REAL, Mathematics, rates_of, vector_with_rates, with_rate
from .laws.vectors import Vector, add
from .model_description import Variable, axis_names, vector_variables
from .slave import INPUT_TIME, MIDDLE_TIME, Slave, read_resource

FIRST_FORCE = 2
MAX_SWEEPS = 8
POSITION_TOLERANCE = 1e-15


class PointMass(Slave):
    """Point mass under the forces of its cables, an external force and its weight."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "point_mass.json")
        self.listed_effects = effects_from_resource(data)
        self.force_count = len(data["start_forces"]) + 1
        self.first_middle_input = FIRST_FORCE + 6 * self.force_count
        self.first_output = self.first_middle_input + 6 * (self.force_count - 1)
        self.has_position_sensor = _has_position_sensor(self.listed_effects)
        # Among the effects only formulas have states on the platform: the time since the start.
        self.time_index = self.first_output + (21 if self.has_position_sensor else 18)
        self.start_velocity: Tuple[float, ...] = tuple(data.get("start_velocity", (0.0, 0.0, 0.0)))
        self.has_motion_dependent_force = any(effect.wrench is not None for effect in self.listed_effects)
        self.end_acceleration: Vector = ()
        # Keyed by the inputs at the start of a step, from which iterations after a rollback start too.
        self.start_node_cache: Tuple[Sequence[float], Tuple[Vector, Vector], AccelerationNode] = (
            (),
            ((), ()),
            AccelerationNode((), ()),
        )
        super().__init__(data, _variables(data), slice(self.first_output, self.first_output + 6), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        self.start_node_cache = ((), ((), ()), AccelerationNode((), ()))
        parameter_values = self.real[self.first_parameter :]
        self.effects = active_effects(self.listed_effects, parameter_values[5:])
        self.constants = law.PointMassConstants(mass=parameter_values[0], gravity=parameter_values[1])
        self.has_time_state = any(active.effect.states for active in self.effects)
        self.position_gain, self.position_offset, self.position_delay = (
            stages.sensor_gains(REAL, self.effects)[1],
            stages.sensor_offsets(REAL, self.effects)[1],
            stages.sensor_delays(REAL, self.effects)[1],
        )
        if not self.started:
            self.real[self.first_output : self.first_output + 6] = [*parameter_values[2:5], *self.start_velocity]

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Hermite quadrature of the acceleration over one step.

        Exact integral of the polynomial through acceleration and its rate at both ends, and in the middle if known.
        Where a wrench depends on the motion, fixed-point sweeps solve for the later nodes; else one sweep is exact.
        """
        first = self.first_output
        start_time = self._time()
        start = MotionState(self.real[first : first + 3], self.real[first + 3 : first + 6], ())
        start_force, start_node = self._start_force_and_node(start, start_time, inputs_at_end)
        forces = [start_force, *self._later_forces(start_force, step, inputs_at_end)]
        middle_weights, end_weights = (QUINTIC_MIDDLE, QUINTIC_END) if len(forces) == 3 else (CUBIC_MIDDLE, CUBIC_END)
        times = (
            (start_time, start_time + step)
            if len(forces) == 2
            else (start_time, start_time + 0.5 * step, start_time + step)
        )
        nodes = [start_node, *(self._node(start, push, time) for push, time in zip(forces[1:], times[1:]))]
        middle, end = (
            integrate_hermite(start, nodes, step, middle_weights),
            integrate_hermite(start, nodes, step, end_weights),
        )
        for _ in range(MAX_SWEEPS if self.has_motion_dependent_force else 0):
            previous_position = end.position
            node_states = (start, end) if len(forces) == 2 else (start, middle, end)
            nodes = [self._node(place, push, time) for place, push, time in zip(node_states, forces, times)]
            middle, end = (
                integrate_hermite(start, nodes, step, middle_weights),
                integrate_hermite(start, nodes, step, end_weights),
            )
            if all(abs(p - q) <= POSITION_TOLERANCE * abs(p) for p, q in zip(end.position, previous_position)):
                break
        if self.position_delay > 0.0:
            self._record_path(step, start, nodes, end)
        self.end_acceleration = end.acceleration
        self.real[first : first + 6] = [*end.position, *end.velocity]
        self.real[first + 9 : first + 18] = [*middle.position, *middle.velocity, *middle.acceleration]
        if self.has_time_state:
            self.real[self.time_index] = start_time + step

    def refresh(self) -> None:
        first = self.first_output
        at_step_end = self.inputs_unchanged and not self.has_motion_dependent_force
        self.real[first + 6 : first + 9] = self.end_acceleration if at_step_end else self._present_acceleration()
        if not self.started:
            self.real[first + 9 : first + 18] = self.real[first : first + 9]
        if self.has_position_sensor:
            delayed_position = (
                [delayed_value(pieces, self.position_delay)[0] for pieces in self.delay_lines]
                if self.position_delay > 0.0
                else []
            )
            shown_position = delayed_position or self.real[first : first + 3]
            self.real[first + 18 : first + 21] = [
                self.position_gain * x + offset for x, offset in zip(shown_position, self.position_offset)
            ]

    def _present_acceleration(self) -> Vector:
        """Acceleration under the present forces."""
        first = self.first_output
        force, rate = self._total_force(self.real)
        force = tuple(f + self.elapsed * r for f, r in zip(force, rate))
        position, velocity = tuple(self.real[first : first + 3]), tuple(self.real[first + 3 : first + 6])
        return self._acceleration(REAL, position, velocity, force, self._time())

    def _record_path(
        self, step: float, start: MotionState, nodes: Sequence[AccelerationNode], end: MotionState
    ) -> None:
        """Append the path of this step to the delay lines of the position sensor."""
        delay_lines = self.delay_lines or ((), (), ())
        columns = zip(start.position, start.velocity, nodes[0].acceleration)
        start_samples = [SignalSample(self.time, numbers) for numbers in columns]
        end_samples = [
            SignalSample(self.time + step, numbers)
            for numbers in zip(end.position, end.velocity, nodes[-1].acceleration)
        ]
        self.delay_lines = tuple(
            append_segment(past, b, e, self.position_delay)
            for past, b, e in zip(delay_lines, start_samples, end_samples)
        )

    def _start_force_and_node(
        self, start: MotionState, time: float, inputs_at_end: bool
    ) -> Tuple[Tuple[Vector, Vector], AccelerationNode]:
        """Total force and its rate at the start of a step, and the quadrature node there."""
        inputs = (
            self.previous_inputs
            if inputs_at_end and self.previous_inputs is not None
            else self.real[: self.input_count]
        )
        start_node_varies = self.has_motion_dependent_force or self.has_time_state
        if start_node_varies or self.start_node_cache[0] != inputs:
            force = self._total_force(inputs)
            self.start_node_cache = (inputs, force, self._node(start, force, time))
        return self.start_node_cache[1:]

    def _later_forces(
        self, start_force: Tuple[Vector, Vector], step: float, inputs_at_end: bool
    ) -> List[Tuple[Vector, Vector]]:
        """Total force and its rate in the middle where it is known, and at the end."""
        if not inputs_at_end:
            force, rate = start_force
            return [(tuple(f + step * r for f, r in zip(force, rate)), rate)]
        assert self.previous_inputs is not None
        middle_forces = [self._total_middle_force(self.previous_inputs, step)] if self.has_middle_inputs else []
        return [*middle_forces, self._total_force(self.real)]

    def _total_force(self, inputs: Any) -> Tuple[Vector, Vector]:
        x, y, z, rx, ry, rz = [sum(inputs[FIRST_FORCE + k : self.first_middle_input : 6]) for k in range(6)]
        return (x, y, z), (rx, ry, rz)

    def _total_middle_force(self, start_inputs: Sequence[float], step: float) -> Tuple[Vector, Vector]:
        """Total force and its rate in the middle: cable forces as set, the external force interpolated."""
        end_inputs, first_external_force = self.real, self.first_middle_input - 6
        sums = [sum(end_inputs[self.first_middle_input + k : self.first_output : 6]) for k in range(6)]
        if not (
            any(start_inputs[first_external_force : first_external_force + 6])
            or any(end_inputs[first_external_force : first_external_force + 6])
        ):
            return sums[:3], sums[3:]
        external_force = [
            cubic_hermite(
                start_inputs[first_external_force + k :: 3][:2],
                end_inputs[first_external_force + k :: 3][:2],
                step,
                0.5,
            )
            for k in range(3)
        ]
        force = tuple(f + value for f, (value, _) in zip(sums[:3], external_force))
        return force, tuple(r + rate for r, (_, rate) in zip(sums[3:], external_force))

    def _time(self) -> float:
        return self.real[self.time_index] if self.has_time_state else 0.0

    def _states(self, time: Any) -> Tuple[Tuple[Any, ...], ...]:
        return tuple((time,) if active.effect.states else () for active in self.effects)

    def _node(self, state: MotionState, force_and_rate: Tuple[Vector, Vector], time: float) -> AccelerationNode:
        force, rate = force_and_rate
        position: Vector = state.position
        velocity: Vector = state.velocity
        if self.has_motion_dependent_force:
            # Only a wrench makes the acceleration's rate depend on the motion, and on the acceleration itself.
            acceleration = self._acceleration(REAL, position, velocity, force, time)
            position = vector_with_rates(position, velocity)
            velocity = vector_with_rates(velocity, acceleration)
        force_with_rate = vector_with_rates(force, rate)
        acceleration_with_rate = self._acceleration(
            COMPLEX_STEP, position, velocity, force_with_rate, with_rate(time, 1.0)
        )
        x, y, z = acceleration_with_rate
        return AccelerationNode((x.real, y.real, z.real), rates_of(acceleration_with_rate))

    def _acceleration(self, m: Mathematics, position: Vector, velocity: Vector, force: Vector, time: Any) -> Vector:
        states = self._states(time)
        total_force = add(force, law.wrench(m, self.effects, states, position, velocity))
        return law.acceleration(m, self.constants, self.effects, states, total_force)


def _has_position_sensor(effects: Sequence[Effect]) -> bool:
    """Whether some effect makes the measured position differ from the true one."""
    return any(effect.component == "sensor" for effect in effects)


def _variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    start = tuple(data["start"])
    return (
        *_inputs(data),
        *_motion_outputs(data),
        *effect_state_variables(data),
        Variable("mass", "parameter", "kg", "mass of the platform", data["mass"], True, 0.0, nominal=data["mass"]),
        Variable("gravity", "parameter", "m/s2", "gravity, along -z", data["gravity"], True),
        *vector_variables(Variable("start", "parameter", "m", "position at the start, at rest"), start),
        *effect_variables(data["effects"]),
    )


def _inputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Forces and their rates at the end of a step, then those of the cables in its middle."""
    weight = float(data["mass"]) * float(data["gravity"])
    cable_forces = tuple(
        (f"_{number}", f"force of cable {number}", tuple(force))
        for number, force in enumerate(data["start_forces"], start=1)
    )
    variables = [INPUT_TIME, MIDDLE_TIME]
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
    name: str, rate_name: str, description: str, start: Tuple[float, float, float], weight: float
) -> Tuple[Variable, ...]:
    return (
        *vector_variables(Variable(name, "input", "N", description, nominal=weight), start),
        *vector_variables(Variable(rate_name, "input", "N/s", f"rate of the {description}", nominal=weight)),
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
    text = "{} in the middle of the last step".format
    middle_position = Variable("middle_position", "output", "m", text("position"))
    middle_velocity = Variable("middle_velocity", "output", "m/s", text("velocity"), rate_of="middle_position")
    middle_acceleration = Variable(
        "middle_acceleration", "output", "m/s2", text("acceleration"), nominal=gravity, rate_of="middle_velocity"
    )
    measured_position = Variable("measured_position", "output", "m", "position as its sensor shows it")
    return (
        *vector_variables(position, start),
        *vector_variables(velocity),
        *vector_variables(acceleration),
        *vector_variables(middle_position, start),
        *vector_variables(middle_velocity),
        *vector_variables(middle_acceleration),
        *(vector_variables(measured_position, start) if _has_position_sensor(effects_from_resource(data)) else ()),
    )
