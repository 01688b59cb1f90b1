"""The platform's motion as CasADi symbols: pose, twist and external wrench, and the rates of pose and twist.

A point mass has a position and a velocity. A rigid body has also a rotation vector r in the axes of the world, in rad,
counted from a reference orientation q_0, and an angular velocity:

    q = exp(r) q_0        dr/dt = omega - r x omega / 2 + k(|r|) r x (r x omega),   k(p) = (1 - p / 2 cot(p / 2)) / p^2

The rotation vector has no singularity below a whole turn from the reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Protocol

import casadi
from casadi import SX

from tautwire_fmu.laws import point_mass as translation
from tautwire_fmu.laws import rigid_body as turning
from tautwire_fmu.laws.effects import ActiveEffect
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.point_mass import PointMassConstants
from tautwire_fmu.laws.rigid_body_effects import BodyConstants, moment_of_effects
from tautwire_fmu.laws.rotation import (
    Matrix,
    Quaternion,
    multiply,
    quaternion_of,
    rotation_matrix,
    rotation_vector_rate,
)
from tautwire_fmu.laws.vectors import Vector, add, subtract

from .active_effects import body_constants
from .schema import AXES, Robot

States = Sequence[tuple[SX, ...]]


@dataclass(frozen=True)
class StateIndices:
    """Indices of the states of a platform with d degrees of freedom on n cables; outputs have the same order.

    Pose and twist are states and outputs; behind them are ``lengths``, unstrained ones, among the states, and
    ``tensions`` among the outputs.
    """

    degrees_of_freedom: int
    cable_count: int

    @property
    def pose(self) -> slice:
        """Pose, (d,)."""
        return slice(0, self.degrees_of_freedom)

    @property
    def twist(self) -> slice:
        """Twist, (d,)."""
        return slice(self.degrees_of_freedom, 2 * self.degrees_of_freedom)

    @property
    def lengths(self) -> slice:
        """Unstrained lengths, (n,)."""
        return slice(2 * self.degrees_of_freedom, 2 * self.degrees_of_freedom + self.cable_count)

    @property
    def tensions(self) -> slice:
        """Tensions, (n,), among the outputs."""
        return self.lengths


class PlatformSymbols(Protocol):
    """Symbols of a platform with d degrees of freedom: ``pose``, ``twist`` and ``external_wrench``, (d,) each.

    The names are those of their entries.
    """

    @property
    def pose(self) -> SX: ...
    @property
    def twist(self) -> SX: ...
    @property
    def external_wrench(self) -> SX: ...
    @property
    def pose_names(self) -> tuple[str, ...]: ...
    @property
    def twist_names(self) -> tuple[str, ...]: ...
    @property
    def wrench_names(self) -> tuple[str, ...]: ...

    def attachment_motion(self, index: int) -> tuple[Vector, Vector]:
        """Position (m) and velocity (m/s) of the point to which a cable is attached, cables counted from 0."""

    def rates(self, forces: Sequence[Vector], effects: Sequence[ActiveEffect], states: States) -> SX:
        """Rates of pose and twist (2 d,) under the forces of the cables (N) and the platform's effects."""


def platform_symbols(
    mathematics: Mathematics,
    robot: Robot,
    constants: PointMassConstants,
    reference_orientation: Quaternion,
    principal_axes: Matrix | None = None,
) -> PlatformSymbols:
    """Symbols of a robot's platform; rotations of a rigid body count from the reference.

    ``principal_axes`` are those of a rigid body, by default those of an inertia of numbers.
    """
    if not robot.platform.is_rigid_body:
        return PointMassSymbols(mathematics, constants)
    body = body_constants(robot, mathematics, principal_axes)
    return RigidBodySymbols(mathematics, constants, body, reference_orientation)


@dataclass(frozen=True)
class PointMassSymbols:
    """Symbols of a point mass: position, velocity and external force."""

    mathematics: Mathematics
    constants: PointMassConstants
    pose: SX = field(default_factory=partial(SX.sym, "position", 3))
    twist: SX = field(default_factory=partial(SX.sym, "velocity", 3))
    external_wrench: SX = field(default_factory=partial(SX.sym, "external_force", 3))
    pose_names = tuple(f"position.{axis}" for axis in AXES)
    twist_names = tuple(f"velocity.{axis}" for axis in AXES)
    wrench_names = tuple(f"external_force.{axis}" for axis in AXES)

    def attachment_motion(self, index: int) -> tuple[Vector, Vector]:
        """See :class:`PlatformSymbols`: all cables are attached to the mass."""
        return vector_of(self.pose), vector_of(self.twist)

    def rates(self, forces: Sequence[Vector], effects: Sequence[ActiveEffect], states: States) -> SX:
        """See :class:`PlatformSymbols`."""
        force: Vector = vector_of(self.external_wrench)
        for each in forces:
            force = add(force, each)
        position, velocity = vector_of(self.pose), vector_of(self.twist)
        force = add(force, translation.wrench(self.mathematics, effects, states, position, velocity))
        acceleration = translation.acceleration(self.mathematics, self.constants, effects, states, force)
        return casadi.vertcat(self.twist, *acceleration)


@dataclass(frozen=True)
class RigidBodySymbols:
    """Symbols of a rigid body: pose and twist of the origin of its frame, external force there and external moment.

    The constants of the ``body`` are those with effects.
    """

    mathematics: Mathematics
    constants: PointMassConstants
    body: BodyConstants
    reference_orientation: Quaternion
    pose: SX = field(default_factory=partial(SX.sym, "pose", 6))
    twist: SX = field(default_factory=partial(SX.sym, "twist", 6))
    external_wrench: SX = field(default_factory=partial(SX.sym, "external_wrench", 6))
    pose_names = tuple(f"{name}.{axis}" for name in ("position", "rotation") for axis in AXES)
    twist_names = tuple(f"{name}.{axis}" for name in ("velocity", "angular_velocity") for axis in AXES)
    wrench_names = tuple(f"{name}.{axis}" for name in ("external_force", "external_moment") for axis in AXES)

    def attachment_motion(self, index: int) -> tuple[Vector, Vector]:
        """See :class:`PlatformSymbols`."""
        return self._point_motion(self.body.attachments[index])

    def rates(self, forces: Sequence[Vector], effects: Sequence[ActiveEffect], states: States) -> SX:
        """See :class:`PlatformSymbols`: Newton's and Euler's equations about the centre of mass."""
        m, centre, rotation, velocity = self.mathematics, self.body.centre_of_mass, self._rotation, self._velocity
        inertia = turning.inertia_of(self.body.inertia)
        all_forces = [vector_of(self.external_wrench[:3]), *forces]
        arms = [subtract(point, centre) for point in ((0.0, 0.0, 0.0), *self.body.attachments)]
        moments = turning.moment_matrix(tuple(zip(*arms, strict=True)), tuple(zip(*all_forces, strict=True)))
        moment = add(turning.moment(rotation, moments), vector_of(self.external_wrench[3:]))
        moment = add(moment, moment_of_effects(m, effects, vector_of(self.twist[3:])))
        force: Vector = (SX(0.0), SX(0.0), SX(0.0))
        for each in all_forces:
            force = add(force, each)
        force = add(force, translation.wrench(m, effects, states, *self._point_motion(centre)))
        acceleration = translation.acceleration(m, self.constants, effects, states, force)
        body_acceleration = turning.angular_acceleration(inertia, rotation, velocity, moment)
        attitude = turning.Attitude(rotation, velocity, body_acceleration)
        of_centre = turning.transform(turning.rotation_matrices(attitude)[2], centre)
        rotation_vector = vector_of(-self.pose[3:])
        return casadi.vertcat(
            self.twist[:3],
            *rotation_vector_rate(m, rotation_vector, vector_of(self.twist[3:])),
            *subtract(acceleration, of_centre),
            *turning.transform(rotation, body_acceleration),
        )

    @cached_property
    def _rotation(self) -> Matrix:
        turned = quaternion_of(self.mathematics, vector_of(self.pose[3:]))
        return rotation_matrix(multiply(turned, self.reference_orientation))

    @cached_property
    def _velocity(self) -> Vector:
        """Angular velocity in the axes of the platform."""
        return turning.transform_back(self._rotation, vector_of(self.twist[3:]))

    @cached_property
    def _rotation_rate(self) -> Matrix:
        return turning.rotation_rate(self._rotation, self._velocity)

    def _point_motion(self, point: Vector) -> tuple[Vector, Vector]:
        """Position and velocity of a point of the platform's frame."""
        position = add(vector_of(self.pose[:3]), turning.transform(self._rotation, point))
        return position, add(vector_of(self.twist[:3]), turning.transform(self._rotation_rate, point))


def vector_of(column: SX) -> Vector:
    """The three entries of a column."""
    return (column[0], column[1], column[2])
