"""The platform as a point mass under the forces of its cables and its weight.

    (m + sum of added masses) a = sum of cable forces + sum of wrenches - (m + sum of added masses) g e_z

The z axis points up. Source: Baklouti et al. 2017, Eq. 5.
"""

from typing import Any, NamedTuple, Optional, Sequence, Tuple

from .effects import ActiveEffect
from .mathematics import Mathematics
from .vectors import Vector, add, scale


class PointMassConstants(NamedTuple):
    """What the robot file declares of the platform: kg and m/s^2."""

    mass: Any
    gravity: Any


def start_states(effects: Sequence[ActiveEffect]) -> Tuple[Tuple[Any, ...], ...]:
    """What the effects remember at the start: nothing."""
    return tuple((0.0,) * len(active.effect.states) for active in effects)


def total_mass(
    m: Mathematics,
    platform: PointMassConstants,
    effects: Sequence[ActiveEffect],
    states: Optional[Sequence[Tuple[Any, ...]]] = None,
) -> Any:
    """Declared mass and what the effects add to it, in kg; at the start where no states are given."""
    mass = platform.mass
    for active, own in zip(effects, start_states(effects) if states is None else states):
        if active.effect.inertia is not None:
            mass = mass + active.effect.inertia(m, active.values, own)
    return mass


def wrench(
    m: Mathematics,
    effects: Sequence[ActiveEffect],
    states: Sequence[Tuple[Any, ...]],
    position: Vector,
    velocity: Vector,
) -> Vector:
    """Force on the platform that comes neither from cables nor from weight, in N."""
    total: Vector = (0.0, 0.0, 0.0)
    for active, own in zip(effects, states):
        if active.effect.wrench is not None:
            total = add(total, active.effect.wrench(m, active.values, own, position, velocity))
    return total


def acceleration(
    m: Mathematics,
    platform: PointMassConstants,
    effects: Sequence[ActiveEffect],
    states: Sequence[Tuple[Any, ...]],
    position: Vector,
    velocity: Vector,
    cable_force: Vector,
) -> Vector:
    """Acceleration in m/s^2 under the summed force of the cables."""
    force = add(cable_force, wrench(m, effects, states, position, velocity))
    pulled = scale(1.0 / total_mass(m, platform, effects, states), force)
    return (pulled[0], pulled[1], pulled[2] - platform.gravity)
