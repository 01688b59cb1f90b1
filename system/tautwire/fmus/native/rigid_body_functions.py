"""Functions of a native rigid platform: its constants and start, its attitude, and one sweep of its rotation's step.

The sweep is that of :func:`tautwire_fmu.rotation_quadrature.integrate_rotation`, whose iteration is left to C.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tautwire_fmu.effect_variables import active_effects, effects_from_resource
from tautwire_fmu.hermite_quadrature import (
    CUBIC_END,
    CUBIC_MIDDLE,
    QUINTIC_END,
    QUINTIC_MIDDLE,
    apply_weights,
)
from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import rigid_body as law
from tautwire_fmu.laws import rigid_body_effects as body_stages
from tautwire_fmu.laws.effects import ActiveEffect
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.rotation import (
    Matrix,
    Quaternion,
    multiply,
    quaternion_of,
    quaternion_rate,
    rotation_matrix,
    rotation_vector_rate,
)
from tautwire_fmu.laws.vectors import Vector, add, cross, scale, subtract
from tautwire_fmu.rigid_body_slave import (
    CENTRE_OF_MASS,
    FIRST_ATTACHMENT,
    INERTIA,
    MAX_LENGTH_ERROR,
    START_ORIENTATION,
)
from tautwire_fmu.rigid_body_variables import INERTIA_ENTRIES
from tautwire_fmu.rotation_quadrature import ORIGIN

from .platform_functions import SENSOR_SIZE, mass_functions
from .traced_functions import Columns, TracedFunction, derivative_along, trace_derivative, trace_function

# Rotation matrix, and angular velocity and acceleration in the platform's axes.
ATTITUDE_SIZE = 15
# Moment matrix of the forces and its rate, then the external moment and its rate.
LOAD_SIZE = 24
AXES_SIZE = 9
START_MOTION_SIZE = 6
SYMMETRIC = {frozenset(entry): index for index, entry in enumerate(INERTIA_ENTRIES)}


def start_size(cable_count: int) -> int:
    """Numbers that follow from the parameters: the sensor's, the arms of the origin and all cables, both inertias."""
    return SENSOR_SIZE + 3 * (1 + cable_count) + 18


def rigid_body_functions(data: Mapping[str, Any]) -> tuple[TracedFunction, ...]:
    """Functions of a rigid platform's resource, see :class:`RigidBody`; those of its mass are with them."""
    body = RigidBody(data)
    sizes = {"parameters": body.parameter_count, "start": start_size(body.cable_count)}
    attitude, load = {"attitude": ATTITUDE_SIZE}, {"load": LOAD_SIZE}
    turning = {"quaternion": 4, "momentum": 3}
    start = {"parameters": body.parameter_count, "principal_axes": AXES_SIZE, "motion": START_MOTION_SIZE}
    points = {**attitude, "mass": 9, "start": sizes["start"]}
    moving = {**turning, **load, "mass": 9}
    return (
        *mass_functions(data, body.first_effect_parameter),
        trace_function("body_start", start, body.start),
        trace_function("body_attitude", {**turning, **load, **sizes}, body.attitude),
        trace_function("body_moment", {**attitude, **load, **sizes}, body.moment),
        trace_function("body_points", points, body.points),
        trace_function("quaternion_rate", {"quaternion": 4, **attitude}, _quaternion_rate),
        trace_derivative("body_derivative", {**moving, **sizes}, body.response, tuple(moving)),
        *_step_functions(body, "two_node", 1, sizes),
        *_step_functions(body, "three_node", 2, sizes),
    )


def _step_functions(
    body: RigidBody, name: str, later_nodes: int, sizes: Mapping[str, int]
) -> tuple[TracedFunction, TracedFunction]:
    loads = {"loads": later_nodes * LOAD_SIZE, "step": 1, **sizes}
    first = {"quaternion": 4, "momentum": 3, "first": ATTITUDE_SIZE, "first_moment": 6, "angles": 6}
    last = {"quaternion": 4, "momenta": 6, "angles": 6, "all_moments": 6 * (1 + later_nodes)}
    return (
        trace_function(f"{name}_sweep", {**first, "attitudes": later_nodes * ATTITUDE_SIZE, **loads}, body.sweep),
        trace_function(f"{name}_rotation", {**last, **loads}, body.rotation_end),
    )


class RigidBody:
    """Equations of a rigid body as functions of its columns."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.listed_effects = effects_from_resource(dict(data))
        self.shifted_cables = [setting.get("cable") for setting in data["effects"]]
        self.cable_count = len(data["attachments"])
        self.first_effect_parameter = FIRST_ATTACHMENT + 3 * self.cable_count
        self.parameter_count = self.first_effect_parameter + sum(len(e.parameters) for e in self.listed_effects)

    def start(self, m: Mathematics, columns: Columns) -> Columns:
        """What follows from the parameters, and quaternion, motion of the centre of mass and momentum at the start.

        Undefined where the inertia is not positive definite or the quaternion of no unit length.
        """
        values, axes = columns["parameters"], columns["principal_axes"]
        constants = self._constants(m, values, (axes[0:3], axes[3:6], axes[6:9]))
        inertia = law.inertia_of(constants.inertia)
        arms = [subtract(point, constants.centre_of_mass) for point in (ORIGIN, *constants.attachments)]
        quaternion = values[START_ORIENTATION:INERTIA]
        length = m.sqrt(sum(part * part for part in quaternion))
        _require_positive(m, *_leading_minors(constants.inertia), MAX_LENGTH_ERROR - m.absolute(length - 1.0))
        unit = [part / length for part in quaternion]
        rotation = rotation_matrix(unit)
        to_centre = scale(-1.0, law.transform(rotation, arms[0]))
        velocity, angular_velocity = columns["motion"][0:3], columns["motion"][3:6]
        in_body = law.transform_back(rotation, angular_velocity)
        momentum = law.transform(rotation, law.transform(inertia.matrix, in_body))
        effects = self._effects(values)
        sensor = [each(m, effects)[1] for each in (stages.sensor_gains, stages.sensor_offsets, stages.sensor_delays)]
        return {
            "start": [sensor[0], *sensor[1], sensor[2], *_flat(arms), *_flat(inertia.matrix), *_flat(inertia.inverse)],
            "states": [
                *unit,
                *add(values[2:5], to_centre),
                *add(velocity, cross(angular_velocity, to_centre)),
                *momentum,
            ],
        }

    def attitude(self, m: Mathematics, columns: Columns) -> Columns:
        """Attitude under a load."""
        return {"attitude": self._attitude(m, columns, columns["quaternion"], columns["momentum"], columns["load"])}

    def moment(self, m: Mathematics, columns: Columns) -> Columns:
        """Moment about the centre of mass in the world's axes, and its rate."""
        return {"moment": self._moment_with_rate(m, columns, columns["attitude"], columns["load"])}

    def points(self, m: Mathematics, columns: Columns) -> Columns:
        """Position, velocity and acceleration of the origin and all attachments, then those of turning."""
        rotation, velocity, acceleration = _split_attitude(columns["attitude"])
        matrices = law.rotation_matrices(law.Attitude(rotation, velocity, acceleration))
        mass, numbers = columns["mass"], columns["start"][SENSOR_SIZE:]
        arms = [numbers[3 * k : 3 * k + 3] for k in range(1 + self.cable_count)]
        points = [
            component
            for arm in arms
            for k, matrix in enumerate(matrices)
            for component in add(mass[3 * k : 3 * k + 3], law.transform(matrix, arm))
        ]
        return {"points": [*points, *law.transform(rotation, velocity), *law.transform(rotation, acceleration)]}

    def response(self, m: Mathematics, columns: Columns) -> Columns:
        """Attitude under a load, its moment about the centre of mass, and the points as :meth:`points` has them."""
        attitude = self.attitude(m, columns)["attitude"]
        rotation, velocity, _ = _split_attitude(attitude)
        moment = self._moment(m, columns, rotation, velocity, columns["load"])
        return {"attitude": attitude, "moment": moment, **self.points(m, {**columns, "attitude": attitude})}

    def sweep(self, m: Mathematics, columns: Columns) -> Columns:
        """One sweep over the later nodes of a step: attitudes, moments, then momenta and angles."""
        step, loads = columns["step"][0], _split(columns["loads"], LOAD_SIZE)
        middle_weights, end_weights = _weights(len(loads))
        quaternions = _quaternions(m, columns["quaternion"], columns["angles"])
        rotations = [rotation_matrix(quaternion) for quaternion in quaternions[2 - len(loads) :]]
        previous = _split(columns["attitudes"], ATTITUDE_SIZE)
        moments = [
            columns["first_moment"],
            *(
                self._moment_with_rate(m, columns, [*_flat(rotation), *attitude[9:]], load)
                for rotation, attitude, load in zip(rotations, previous, loads, strict=True)
            ),
        ]
        pairs = [(moment[:3], moment[3:]) for moment in moments]
        momenta = [
            apply_weights(columns["momentum"], pairs, step, step * step, weights.velocity)
            for weights in (middle_weights, end_weights)
        ]
        attitudes = [
            self._attitude_under(columns, rotation, momentum, moment[:3])
            for rotation, momentum, moment in zip(rotations, momenta[2 - len(loads) :], moments[1:], strict=True)
        ]
        nodes = _angle_nodes(m, [columns["first"], *attitudes], columns["angles"])
        angles = [
            apply_weights(ORIGIN, nodes, step, step * step, weights.velocity)
            for weights in (middle_weights, end_weights)
        ]
        return {
            "new_attitudes": _flat(attitudes),
            "moments": _flat(moments[1:]),
            "momenta": _flat(momenta),
            "new_angles": _flat(angles),
        }

    def rotation_end(self, m: Mathematics, columns: Columns) -> Columns:
        """Quaternion at the end, and the attitudes in the middle and at the end of a step, after the last sweep."""
        step, loads = columns["step"][0], _split(columns["loads"], LOAD_SIZE)
        middle, end = _quaternions(m, columns["quaternion"], columns["angles"])
        middle_momentum, end_momentum = _split(columns["momenta"], 3)
        length = m.sqrt(sum(part * part for part in end))
        end = [part / length for part in end]
        if len(loads) == 2:
            middle_attitude = self._attitude(m, columns, middle, middle_momentum, loads[0])
        else:
            pairs = [(moment[:3], moment[3:]) for moment in _split(columns["all_moments"], 6)]
            moment = apply_weights(ORIGIN, pairs, 1.0, step, CUBIC_MIDDLE.acceleration)
            middle_attitude = self._attitude_under(columns, rotation_matrix(middle), middle_momentum, moment)
        return {
            "end": end,
            "middle_attitude": middle_attitude,
            "end_attitude": self._attitude(m, columns, end, end_momentum, loads[-1]),
        }

    def _effects(self, parameters: Sequence[Any]) -> tuple[ActiveEffect, ...]:
        return active_effects(self.listed_effects, parameters[self.first_effect_parameter :])

    def _constants(self, m: Mathematics, values: Sequence[Any], principal_axes: Matrix) -> body_stages.BodyConstants:
        entries = values[INERTIA:CENTRE_OF_MASS]
        x, y, z = (tuple(entries[SYMMETRIC[frozenset((row, column))]] for column in "xyz") for row in "xyz")
        attachments = _split(values[FIRST_ATTACHMENT : self.first_effect_parameter], 3)
        centre, effects = values[CENTRE_OF_MASS:FIRST_ATTACHMENT], self._effects(values)
        body = body_stages.BodyConstants(values[0], (x, y, z), principal_axes, centre, attachments)
        of_cables = [
            [active for active, shifted in zip(effects, self.shifted_cables, strict=False) if shifted == cable]
            for cable in range(1, self.cable_count + 1)
        ]
        return body_stages.constants_with_effects(m, body, effects, of_cables)

    def _inertia(self, columns: Columns) -> law.Inertia:
        matrix, inverse = _split(columns["start"][-18:], 9)
        return law.Inertia(_matrix(matrix), _matrix(inverse))

    def _attitude(
        self, m: Mathematics, columns: Columns, quaternion: Quaternion, momentum: Vector, load: Sequence[Any]
    ) -> list[Any]:
        rotation = rotation_matrix(quaternion)
        velocity = law.angular_velocity(self._inertia(columns), rotation, momentum)
        return self._attitude_under(columns, rotation, momentum, self._moment(m, columns, rotation, velocity, load))

    def _attitude_under(self, columns: Columns, rotation: Matrix, momentum: Vector, moment: Vector) -> list[Any]:
        inertia = self._inertia(columns)
        velocity = law.angular_velocity(inertia, rotation, momentum)
        acceleration = law.angular_acceleration(inertia, rotation, velocity, moment)
        return [*_flat(rotation), *velocity, *acceleration]

    def _moment(
        self, m: Mathematics, columns: Columns, rotation: Matrix, velocity: Vector, load: Sequence[Any]
    ) -> Vector:
        effects = self._effects(columns["parameters"])
        of_effects = body_stages.moment_of_effects(m, effects, law.transform(rotation, velocity))
        return add(add(law.moment(rotation, _matrix(load[0:9])), load[18:21]), of_effects)

    def _moment_with_rate(
        self, m: Mathematics, columns: Columns, attitude: Sequence[Any], load: Sequence[Any]
    ) -> list[Any]:
        rotation, velocity, acceleration = _split_attitude(attitude)
        forces, force_rates = _matrix(load[0:9]), _matrix(load[9:18])
        rate = add(law.moment(rotation, force_rates), law.moment(law.rotation_rate(rotation, velocity), forces))
        effects = self._effects(columns["parameters"])
        of_effects = derivative_along(
            lambda each, turning: body_stages.moment_of_effects(each, effects, turning),
            law.transform(rotation, velocity),
            law.transform(rotation, acceleration),
        )
        rate = add(add(rate, load[21:24]), of_effects)
        return [*self._moment(m, columns, rotation, velocity, load), *rate]


def _weights(later_nodes: int) -> tuple[Any, Any]:
    return (QUINTIC_MIDDLE, QUINTIC_END) if later_nodes == 2 else (CUBIC_MIDDLE, CUBIC_END)


def _quaternion_rate(m: Mathematics, columns: Columns) -> Columns:
    _, velocity, _ = _split_attitude(columns["attitude"])
    return {"rate": quaternion_rate(columns["quaternion"], velocity)}


def _quaternions(m: Mathematics, start: Quaternion, angles: Sequence[Any]) -> tuple[Quaternion, Quaternion]:
    """Orientations in the middle and at the end of the step."""
    middle = multiply(start, quaternion_of(m, angles[:3]))
    return middle, multiply(middle, quaternion_of(m, subtract(angles[3:], angles[:3])))


def _angle_nodes(m: Mathematics, attitudes: Sequence[Sequence[Any]], angles: Sequence[Any]) -> list[Any]:
    """Rate of the rotation vector, and the rate of that, at each node."""
    middle, end = angles[:3], angles[3:]
    first, last = attitudes[0], attitudes[-1]
    in_the_middle = [(attitude[9:12], attitude[12:15]) for attitude in attitudes[1:-1]]
    return [
        _angle_node(m, first, scale(-1.0, middle)),
        *in_the_middle,
        _angle_node(m, last, subtract(end, middle)),
    ]


def _angle_node(m: Mathematics, attitude: Sequence[Any], angles: Vector) -> tuple[Vector, Vector]:
    rate = rotation_vector_rate(m, angles, attitude[9:12])
    second = derivative_along(
        lambda each, values: rotation_vector_rate(each, values[:3], values[3:]),
        [*angles, *attitude[9:12]],
        [*rate, *attitude[12:15]],
    )
    return rate, second


def _require_positive(m: Mathematics, *values: Any) -> None:
    """Leave the law undefined unless all are positive: by logarithms, whose domain is recorded."""
    for value in values:
        m.log(value)


def _leading_minors(matrix: Matrix) -> tuple[Any, Any, Any]:
    (a, d, e), (_, b, f), (_, _, c) = matrix
    return a, a * b - d * d, a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e)


def _split(values: Sequence[Any], size: int) -> list[Any]:
    return [values[k : k + size] for k in range(0, len(values), size)]


def _flat(rows: Sequence[Sequence[Any]]) -> list[Any]:
    return [entry for row in rows for entry in row]


def _matrix(entries: Sequence[Any]) -> Matrix:
    return entries[0:3], entries[3:6], entries[6:9]


def _split_attitude(attitude: Sequence[Any]) -> tuple[Matrix, Vector, Vector]:
    return _matrix(attitude[:9]), attitude[9:12], attitude[12:15]
