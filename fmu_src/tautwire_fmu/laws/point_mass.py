"""Equation of motion of the platform as a point mass under cable forces and weight.

    (m + sum of added masses) a = sum of cable forces + sum of wrenches - (m + sum of added masses) g e_z

The z axis points up. Source: Baklouti et al. 2017, Eq. 5.
"""

from typing import Any, NamedTuple, Optional, Sequence, Tuple

from .effects import ActiveEffect
from .mathematics import Mathematics
from .vectors import Vector, add, scale


class PointMassConstants(NamedTuple):
    """Constants of the platform by the robot file: mass in kg and gravity in m/s^2."""

    mass: Any
    gravity: Any


def start_states(effects: Sequence[ActiveEffect]) -> Tuple[Tuple[Any, ...], ...]:
    """States of the effects at the start: all zero."""
    return tuple((0.0,) * len(active.effect.states) for active in effects)


def total_mass(
    m: Mathematics,
    platform: PointMassConstants,
    effects: Sequence[ActiveEffect],
    states: Optional[Sequence[Tuple[Any, ...]]] = None,
) -> Any:
    """Declared mass plus the added masses of the effects, in kg; at the start where no states are given."""
    mass = platform.mass
    for active, effect_states in zip(effects, start_states(effects) if states is None else states):
        if active.effect.inertia is not None:
            mass = mass + active.effect.inertia(m, active.values, effect_states)
    return mass


def wrench(
    m: Mathematics,
    effects: Sequence[ActiveEffect],
    states: Sequence[Tuple[Any, ...]],
    position: Vector,
    velocity: Vector,
) -> Vector:
    """Force on the platform by effects, beside cables and weight, in N."""
    total: Vector = (0.0, 0.0, 0.0)
    for active, effect_states in zip(effects, states):
        if active.effect.wrench is not None:
            total = add(total, active.effect.wrench(m, active.values, effect_states, position, velocity))
    return total


def acceleration(
    m: Mathematics,
    platform: PointMassConstants,
    effects: Sequence[ActiveEffect],
    states: Sequence[Tuple[Any, ...]],
    force: Vector,
) -> Vector:
    """Acceleration in m/s^2 under weight and a force in N: the sum of the cables' and of :func:`wrench`."""
    specific_force = scale(1.0 / total_mass(m, platform, effects, states), force)
    return (specific_force[0], specific_force[1], specific_force[2] - platform.gravity)
