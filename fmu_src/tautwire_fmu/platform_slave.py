"""Base of the FMI slaves of all platforms: forces, the motion of the mass, effects, and the position sensor."""

from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from .delay_line import SignalSample, append_segment, delayed_value
from .effect_variables import active_effects, effects_from_resource
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
from .laws.mathematics import COMPLEX_STEP, REAL, Mathematics, rates_of, vector_with_rates, with_rate
from .laws.vectors import Vector, add
from .model_description import Variable
from .platform_variables import has_position_sensor
from .slave import Slave

MAX_SWEEPS = 8
POSITION_TOLERANCE = 1e-15


class Translation(NamedTuple):
    """Motion of the mass over a step: the quadrature nodes, and the states in the middle and at the end."""

    nodes: Sequence[AccelerationNode]
    middle: MotionState
    end: MotionState


class PlatformSlave(Slave):
    """Platform whose mass moves under the forces of its cables, an external force, those of effects, and its weight.

    Subclasses lay out the variables, and say in :attr:`first_force` where the forces begin: those of the cables, an
    external one, then those of the cables in the middle of a step, each force before its rate. The effects' parameters
    begin ``first_effect_parameter`` after the first parameter.
    """

    first_force: int
    first_effect_parameter: int
    time_index: int
    measured_position_index: int

    def __init__(self, data: Dict[str, Any], variables: Sequence[Variable], states: slice, **kwargs: Any) -> None:
        self.listed_effects = effects_from_resource(data)
        self.force_count = len(data["start_forces"]) + 1
        self.first_middle_force = self.first_force + 6 * self.force_count
        self.middle_force_end = self.first_middle_force + 6 * (self.force_count - 1)
        self.has_position_sensor = has_position_sensor(data)
        self.has_motion_dependent_force = any(effect.wrench is not None for effect in self.listed_effects)
        self.constants: Any = None
        # Keyed by the inputs at the start of a step, from which iterations after a rollback start too.
        self.start_node_cache: Tuple[Sequence[float], Tuple[Vector, Vector], AccelerationNode] = (
            (),
            ((), ()),
            AccelerationNode((), ()),
        )
        super().__init__(data, variables, states, **kwargs)

    def parameters_changed(self) -> None:
        self.start_node_cache = ((), ((), ()), AccelerationNode((), ()))
        parameter_values = self.real[self.first_parameter :]
        self.effects = active_effects(self.listed_effects, parameter_values[self.first_effect_parameter :])
        self.constants = law.PointMassConstants(mass=parameter_values[0], gravity=parameter_values[1])
        self.has_time_state = any(active.effect.states for active in self.effects)
        self.position_gain, self.position_offset, self.position_delay = (
            stages.sensor_gains(REAL, self.effects)[1],
            stages.sensor_offsets(REAL, self.effects)[1],
            stages.sensor_delays(REAL, self.effects)[1],
        )

    def translate(self, start: MotionState, step: float, inputs_at_end: bool) -> Translation:
        """Hermite quadrature of the acceleration over one step.

        Exact integral of the polynomial through acceleration and its rate at both ends, and in the middle if known.
        Where a wrench depends on the motion, fixed-point sweeps solve for the later nodes; else one sweep is exact.
        """
        start_time = self._time()
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
        if self.has_time_state:
            self.real[self.time_index] = start_time + step
        return Translation(nodes, middle, end)

    def present_acceleration(self, position: Vector, velocity: Vector) -> Vector:
        """Acceleration of the mass under the present forces."""
        force, rate = self._total_force(self.real)
        force = tuple(f + self.elapsed * r for f, r in zip(force, rate))
        return self._acceleration(REAL, position, velocity, force, self._time())

    def record_path(self, step: float, start: MotionState, end: MotionState) -> None:
        """Append the path of this step to the delay lines of the position sensor."""
        delay_lines = self.delay_lines or ((), (), ())
        start_samples = [SignalSample(self.time, numbers) for numbers in zip(*start)]
        end_samples = [SignalSample(self.time + step, numbers) for numbers in zip(*end)]
        self.delay_lines = tuple(
            append_segment(past, b, e, self.position_delay)
            for past, b, e in zip(delay_lines, start_samples, end_samples)
        )

    def refresh_measured_position(self, position: Sequence[float]) -> None:
        """Set the measured position, which effects make differ from the true one."""
        delayed_position = (
            [delayed_value(pieces, self.position_delay)[0] for pieces in self.delay_lines]
            if self.position_delay > 0.0
            else []
        )
        self.real[self.measured_position_index : self.measured_position_index + 3] = [
            self.position_gain * x + offset for x, offset in zip(delayed_position or position, self.position_offset)
        ]

    def inputs_at_start(self, inputs_at_end: bool) -> Sequence[float]:
        """Inputs that hold at the start of a step."""
        return (
            self.previous_inputs
            if inputs_at_end and self.previous_inputs is not None
            else self.real[: self.input_count]
        )

    def _start_force_and_node(
        self, start: MotionState, time: float, inputs_at_end: bool
    ) -> Tuple[Tuple[Vector, Vector], AccelerationNode]:
        """Total force and its rate at the start of a step, and the quadrature node there."""
        inputs = self.inputs_at_start(inputs_at_end)
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
        first, end = self.first_force, self.first_middle_force
        x, y, z, rx, ry, rz = [sum(inputs[k:end:6]) for k in range(first, first + 6)]
        return (x, y, z), (rx, ry, rz)

    def _total_middle_force(self, start_inputs: Sequence[float], step: float) -> Tuple[Vector, Vector]:
        """Total force and its rate in the middle: cable forces as set, the external force interpolated."""
        inputs, first, end = self.real, self.first_middle_force, self.middle_force_end
        sums = [sum(inputs[k:end:6]) for k in range(first, first + 6)]
        external_force = self.middle_of_inputs(start_inputs, first - 6, step)
        if external_force is None:
            return sums[:3], sums[3:]
        force, rate = external_force
        return add(sums[:3], force), add(sums[3:], rate)

    def middle_of_inputs(
        self, start_inputs: Sequence[float], first: int, step: float
    ) -> Optional[Tuple[Sequence[float], Sequence[float]]]:
        """Value and rate in the middle of a step of the vector input at ``first``, interpolated; None where zero."""
        start, end = start_inputs[first : first + 6], self.real[first : first + 6]
        if not (any(start) or any(end)):
            return None
        axes = [cubic_hermite(start[k::3], end[k::3], step, 0.5) for k in range(3)]
        return [value for value, _ in axes], [rate for _, rate in axes]

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
