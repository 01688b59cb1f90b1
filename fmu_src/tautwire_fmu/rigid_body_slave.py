"""FMI slave of the rigid platform: cable forces in, motion of its frame and of each cable's attachment out."""

import math
from typing import Any, List, Optional, Sequence, Tuple

from .hermite_quadrature import MotionState
from .laws import rigid_body as law
from .laws import rigid_body_effects as body_stages
from .laws.mathematics import REAL, Mathematics
from .laws.rotation import rotation_matrix
from .laws.vectors import Vector, add, cross, scale, subtract
from .platform_slave import PlatformSlave
from .rigid_body_variables import INERTIA_ENTRIES, rigid_body_variables
from .rotation_quadrature import ORIGIN, Body, Load, RotationState, attitude_of, integrate_rotation
from .slave import read_resource

EXTERNAL_MOMENT = 2
# Parameters: mass, gravity, start, then these.
START_ORIENTATION, INERTIA, CENTRE_OF_MASS, FIRST_ATTACHMENT = 5, 9, 15, 18
MAX_LENGTH_ERROR = 1e-6


class RigidBody(PlatformSlave):
    """Rigid body under the forces of its cables, an external force and moment, and its weight."""

    first_force = 8

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "rigid_body.json")
        variables = rigid_body_variables(data)
        names = [variable.name for variable in variables]
        self.cable_count = len(data["attachments"])
        # Cable whose attachment an effect shifts, counted from 1; None for an effect on the platform.
        self.shifted_cables = [setting.get("cable") for setting in data["effects"]]
        self.first_effect_parameter = FIRST_ATTACHMENT + 3 * self.cable_count
        self.first_output = names.index("position.x")
        self.angular_output = names.index("angular_velocity.x")
        self.middle_output = self.angular_output + 6
        self.measured_position_index = self.middle_output + 9 * self.cable_count
        self.state_index = names.index("orientation.w")
        # Among the effects only formulas have states on the platform: the time since the start.
        self.time_index = self.state_index + 13
        self.start_velocity: Vector = tuple(data.get("start_velocity", ORIGIN))
        self.start_angular_velocity: Vector = tuple(data.get("start_angular_velocity", ORIGIN))
        self.end_motion: Sequence[float] = ()
        # Keyed by the inputs at the start of a step, as the node of the translation.
        self.start_load_cache: Tuple[Sequence[float], Optional[Load]] = ((), None)
        self.problem = ""
        super().__init__(data, variables, slice(self.state_index, self.state_index + 13), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        super().parameters_changed()
        values = self.real[self.first_parameter : self.first_parameter + self.first_effect_parameter]
        body = self._constants(values)
        self.arms = [subtract(point, body.centre_of_mass) for point in (ORIGIN, *body.attachments)]
        # The external force, the last one, acts at the origin.
        self.arms_by_axis = tuple(zip(*self.arms[1:], self.arms[0]))
        self.start_load_cache = ((), None)
        self.problem = _inertia_problem(body.inertia) or _quaternion_problem(values[START_ORIENTATION:INERTIA])
        if not self.problem:
            self.body = Body(
                law.inertia_of(body.inertia),
                self._moment_of_effects if body_stages.has_moment(self.effects) else None,
            )
            if not self.started:
                self.real[self.states] = self._start_state(values)

    def _constants(self, values: Sequence[float]) -> body_stages.BodyConstants:
        """Constants of the body by its parameters, effects included."""
        entries = dict(zip(INERTIA_ENTRIES, values[INERTIA:CENTRE_OF_MASS]))
        x, y, z = (tuple(entries["".join(sorted(row + column))] for column in "xyz") for row in "xyz")
        attachments = [values[k : k + 3] for k in range(FIRST_ATTACHMENT, len(values), 3)]
        centre = values[CENTRE_OF_MASS:FIRST_ATTACHMENT]
        body = body_stages.BodyConstants(values[0], (x, y, z), law.principal_axes((x, y, z)), centre, attachments)
        of_cables = [
            [active for active, shifted in zip(self.effects, self.shifted_cables) if shifted == cable]
            for cable in range(1, self.cable_count + 1)
        ]
        return body_stages.constants_with_effects(REAL, body, self.effects, of_cables)

    def _moment_of_effects(self, m: Mathematics, angular_velocity: Vector) -> Vector:
        return body_stages.moment_of_effects(m, self.effects, angular_velocity)

    def _start_state(self, values: Sequence[float]) -> List[float]:
        """Quaternion, position and velocity of the centre of mass, and angular momentum at the start."""
        length = math.sqrt(sum(part * part for part in values[START_ORIENTATION:INERTIA]))
        quaternion = [part / length for part in values[START_ORIENTATION:INERTIA]]
        rotation = rotation_matrix(quaternion)
        to_centre = scale(-1.0, law.transform(rotation, self.arms[0]))
        angular_velocity = self.start_angular_velocity
        velocity = add(self.start_velocity, cross(angular_velocity, to_centre))
        in_body = law.transform_back(rotation, angular_velocity)
        momentum = law.transform(rotation, law.transform(self.body.inertia.matrix, in_body))
        return [*quaternion, *add(values[2:5], to_centre), *velocity, *momentum]

    def exit_initialization_mode(self) -> None:
        super().exit_initialization_mode()
        if self.problem:
            self._raise_to_importer(self.problem)

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Integrate the motion of the centre of mass and the rotation about it over one step."""
        self._require_valid_parameters()
        rotation_state, mass = self._present_state()
        loads = self._loads(step, inputs_at_end)
        rotation = integrate_rotation(self.body, rotation_state, loads, step)
        nodes, middle, end = self.translate(mass, step, inputs_at_end)
        self.real[self.states] = [*rotation.end.quaternion, *end.position, *end.velocity, *rotation.end.momentum]
        if self.position_delay > 0.0:
            start_attitude = attitude_of(self.body, rotation_state, loads[0])
            before = _motion(start_attitude, mass._replace(acceleration=nodes[0].acceleration), self.arms[:1])
            after = _motion(rotation.end_attitude, end, self.arms[:1])
            self.record_path(step, *(MotionState(each[:3], each[3:6], each[6:]) for each in (before, after)))
        self.end_motion = [*_motion(rotation.end_attitude, end, self.arms), *_turning(rotation.end_attitude)]
        self.real[self.middle_output : self.measured_position_index] = _motion(
            rotation.middle_attitude, middle, self.arms[1:]
        )

    def refresh(self) -> None:
        self._require_valid_parameters()
        at_step_end = self.inputs_unchanged and not self.has_motion_dependent_force
        self.real[self.first_output : self.middle_output] = self.end_motion if at_step_end else self._present_motion()
        if not self.started:
            attachments = self.real[self.first_output + 9 : self.angular_output]
            self.real[self.middle_output : self.measured_position_index] = attachments
        if self.has_position_sensor:
            self.refresh_measured_position(self.real[self.first_output : self.first_output + 3])

    def _require_valid_parameters(self) -> None:
        if self.problem:
            raise ValueError(self.problem)

    def _present_state(self) -> Tuple[RotationState, MotionState]:
        state = self.real[self.states]
        return RotationState(state[:4], state[10:]), MotionState(state[4:7], state[7:10], ())

    def _present_motion(self) -> Sequence[float]:
        """Motion under the present forces."""
        rotation_state, mass = self._present_state()
        load = self._extrapolated(self._load(self.real), self.elapsed)
        attitude = attitude_of(self.body, rotation_state, load)
        acceleration = self.present_acceleration(mass.position, mass.velocity)
        return [*_motion(attitude, mass._replace(acceleration=acceleration), self.arms), *_turning(attitude)]

    def _loads(self, step: float, inputs_at_end: bool) -> List[Load]:
        """Loads at the start, in the middle where they are known, and at the end of a step."""
        inputs = self.inputs_at_start(inputs_at_end)
        start_inputs, start = self.start_load_cache
        if start is None or start_inputs != inputs:
            start = self._load(inputs)
            self.start_load_cache = (inputs, start)
        if not inputs_at_end:
            return [start, self._extrapolated(start, step)]
        return [start, *([self._middle_load(inputs, step)] if self.has_middle_inputs else []), self._load(self.real)]

    def _load(self, inputs: Sequence[float]) -> Load:
        first, end = self.first_force, self.first_middle_force
        forces = [inputs[k:end:6] for k in range(first, first + 6)]
        return Load(
            law.moment_matrix(self.arms_by_axis, forces[:3]),
            law.moment_matrix(self.arms_by_axis, forces[3:]),
            inputs[EXTERNAL_MOMENT : EXTERNAL_MOMENT + 3],
            inputs[EXTERNAL_MOMENT + 3 : EXTERNAL_MOMENT + 6],
        )

    def _middle_load(self, start_inputs: Sequence[float], step: float) -> Load:
        """Load in the middle: cable forces as set, external force and moment interpolated."""
        first, end = self.first_middle_force, self.middle_force_end
        external_force = self.middle_of_inputs(start_inputs, first - 6, step) or (ORIGIN, ORIGIN)
        external = [component for vector in external_force for component in vector]
        forces = [[*self.real[first + k : end : 6], external[k]] for k in range(6)]
        return Load(
            law.moment_matrix(self.arms_by_axis, forces[:3]),
            law.moment_matrix(self.arms_by_axis, forces[3:]),
            *(self.middle_of_inputs(start_inputs, EXTERNAL_MOMENT, step) or ()),
        )

    def _extrapolated(self, load: Load, elapsed: float) -> Load:
        """Load after some time at its present rate."""
        if not elapsed:
            return load
        x, y, z = (add(row, scale(elapsed, rate)) for row, rate in zip(load.forces, load.force_rates))
        return load._replace(forces=(x, y, z), moment=add(load.moment, scale(elapsed, load.moment_rate)))


def _motion(attitude: law.Attitude, mass: MotionState, arms: Sequence[Vector]) -> List[float]:
    """Position, velocity and acceleration of points, one after the other."""
    rows = [
        (offset, *row)
        for offsets, matrix in zip(mass, law.rotation_matrices(attitude))
        for offset, row in zip(offsets, matrix)
    ]
    return [offset + (a * x + b * y + c * z) for x, y, z in arms for offset, a, b, c in rows]


def _turning(attitude: law.Attitude) -> Tuple[float, ...]:
    """Angular velocity and acceleration in the axes of the world."""
    return (
        *law.transform(attitude.rotation, attitude.velocity),
        *law.transform(attitude.rotation, attitude.acceleration),
    )


def _inertia_problem(matrix: Sequence[Sequence[float]]) -> str:
    (a, d, e), (_, b, f), (_, _, c) = matrix
    minors = (a, a * b - d * d, a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e))
    if min(minors) > 0.0:
        return ""
    return f"inertia is {[list(row) for row in matrix]!r} kg m2, it has to be positive definite"


def _quaternion_problem(quaternion: Sequence[float]) -> str:
    length = math.sqrt(sum(part * part for part in quaternion))
    if abs(length - 1.0) <= MAX_LENGTH_ERROR:
        return ""
    return f"start_orientation has the length {length!r}, it has to be a quaternion of length 1"
