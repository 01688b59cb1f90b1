"""Combined contributions of effects to a rigid body: its constants, and the moment on it."""

from typing import Any, NamedTuple, Sequence, Tuple

from .effects import ActiveEffect
from .mathematics import Mathematics
from .rigid_body import transform
from .rotation import Matrix
from .vectors import Vector, add, dot, scale

Effects = Sequence[ActiveEffect]
ORIGIN = (0.0, 0.0, 0.0)


class BodyConstants(NamedTuple):
    """Constants of a rigid body in its frame: mass in kg, inertia in kg m^2 by rows, positions in m.

    ``inertia`` is about the ``centre_of_mass``; ``principal_axes`` are its unit vectors, by rows.
    """

    mass: Any
    inertia: Matrix
    principal_axes: Matrix
    centre_of_mass: Vector
    attachments: Sequence[Vector]


def constants_with_effects(
    m: Mathematics, body: BodyConstants, effects: Effects, attachment_effects: Sequence[Effects]
) -> BodyConstants:
    """Constants with the effects on the platform, and those that shift the attachment of each cable.

    Masses m_k at p_k from the centre of mass move it by ``s = sum of m_k p_k / M``, M the whole mass, and the inertia
    becomes ``I + sum of m_k (p_k^2 - p_k p_k^T) - M (s^2 - s s^T)``. Of the masses that effects add only those that
    have a position count; the others act at the common centre of mass.
    """
    centre, mass, inertia = body.centre_of_mass, body.mass, body.inertia
    arm: Vector = ORIGIN
    for active in effects:
        if active.effect.centre_of_mass is not None:
            centre = add(centre, active.effect.centre_of_mass(m, active.values))
        if active.effect.inertia_factors is not None:
            factors = active.effect.inertia_factors(m, active.values)
            inertia = _sum(inertia, _change_of_principal_moments(body, factors))
        if active.effect.mass_position is not None and active.effect.inertia is not None:
            added_mass = active.effect.inertia(m, active.values, ())
            position = active.effect.mass_position(m, active.values)
            inertia = _sum(inertia, _point_inertia(added_mass, position))
            mass, arm = mass + added_mass, add(arm, scale(added_mass, position))
    shift = scale(1.0 / mass, arm)
    return body._replace(
        mass=mass,
        inertia=_sum(inertia, _point_inertia(-mass, shift)),
        centre_of_mass=add(centre, shift),
        attachments=[shifted_attachment(m, *each) for each in zip(body.attachments, attachment_effects)],
    )


def shifted_attachment(m: Mathematics, attachment: Vector, effects: Effects) -> Vector:
    """Attachment of a cable with its effects, in m in the platform's frame."""
    for active in effects:
        if active.effect.attachment is not None:
            attachment = add(attachment, active.effect.attachment(m, active.values))
    return attachment


def has_moment(effects: Effects) -> bool:
    """Whether an effect exerts a moment by the angular velocity."""
    return any(active.effect.moment is not None for active in effects)


def moment_of_effects(m: Mathematics, effects: Effects, angular_velocity: Vector) -> Vector:
    """Moment on the platform at an angular velocity (rad/s), in N m; both in the axes of the world."""
    total: Vector = ORIGIN
    for active in effects:
        if active.effect.moment is not None:
            total = add(total, active.effect.moment(m, active.values, angular_velocity))
    return total


def _change_of_principal_moments(body: BodyConstants, factors: Tuple[Any, Any, Any]) -> Matrix:
    """Inertia that the principal moments gain, multiplied by factors."""
    x, y, z = [
        (factor - 1.0) * dot(axis, transform(body.inertia, axis)) for factor, axis in zip(factors, body.principal_axes)
    ]
    first, second, third = body.principal_axes
    return _sum(_sum(_outer(x, first), _outer(y, second)), _outer(z, third))


def _point_inertia(mass: Any, position: Vector) -> Matrix:
    """Inertia of a point at a position about the origin, ``m (p^2 - p p^T)``."""
    square = mass * dot(position, position)
    diagonal = ((square, 0.0, 0.0), (0.0, square, 0.0), (0.0, 0.0, square))
    return _sum(diagonal, _outer(-mass, position))


def _outer(factor: Any, vector: Vector) -> Matrix:
    """The multiple ``factor v v^T``."""
    x, y, z = scale(factor, vector)
    return (scale(x, vector), scale(y, vector), scale(z, vector))


def _sum(a: Matrix, b: Matrix) -> Matrix:
    return (add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2]))
