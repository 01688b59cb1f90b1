"""Combined contributions of a cable's effects, stage by stage."""

from typing import Any, List, NamedTuple, Sequence, Tuple

from .effects import ActiveEffect
from .mathematics import Mathematics
from .rotation import quaternion_to_vertical, rotate, rotate_back
from .vectors import Vector, add, norm, scale, subtract

VERTICAL = (0.0, 0.0, 1.0)
# Shortest time constant of a filter, in s; shorter ones act as this one.
SHORTEST_FILTER = 1e-3

Effects = Sequence[ActiveEffect]
States = Sequence[Tuple[Any, ...]]


class Route(NamedTuple):
    """Route of the rope to the exit point: ``direction`` is its unit vector at the platform, ``length`` in m.

    ``chord`` is the straight distance in m.
    """

    direction: Vector
    length: Any
    chord: Any


def route(m: Mathematics, effects: Effects, anchor: Vector, position: Vector, swivel_axis: Vector = VERTICAL) -> Route:
    """Route straight to the declared exit point, or as the effects change it.

    The exit pulley swivels about the unit vector ``swivel_axis``, along which the rope arrives there.
    """
    for active in effects:
        if active.effect.exit_point is not None:
            anchor = add(anchor, active.effect.exit_point(m, active.values))
    line = subtract(anchor, position)
    chord = norm(m, line)
    for active in effects:
        if active.effect.path is not None:
            if tuple(swivel_axis) == VERTICAL:
                direction, length = active.effect.path(m, active.values, line)
            else:
                upright = quaternion_to_vertical(m, swivel_axis)
                direction, length = active.effect.path(m, active.values, rotate(upright, line))
                direction = rotate_back(upright, direction)
            return Route(direction, length, chord)
    return Route(scale(1.0 / chord, line), chord, chord)


def stiffness(m: Mathematics, effects: Effects, states: States, cable: Any) -> Tuple[Any, Any]:
    """Modulus, and the stress at no strain beside that of the start tension; both in Pa."""
    modulus: Any = cable.modulus
    stress: Any = 0.0
    for active, effect_states in zip(effects, states):
        if active.effect.stiffness is not None:
            modulus_change, stress_change = active.effect.stiffness(m, active.values, effect_states, cable)
            modulus = modulus + modulus_change
            stress = stress + stress_change
    return modulus, stress


def viscosity(m: Mathematics, effects: Effects, cable: Any) -> Any:
    """Total damping, in Pa s."""
    total: Any = cable.damping
    for active in effects:
        if active.effect.viscosity is not None:
            total = total + active.effect.viscosity(m, active.values, cable)
    return total


def free_strain(m: Mathematics, effects: Effects, states: States) -> Any:
    """Strain that carries no tension."""
    total: Any = 0.0
    for active, effect_states in zip(effects, states):
        if active.effect.free_strain is not None:
            total = total + active.effect.free_strain(m, active.values, effect_states)
    return total


def free_strain_rate(m: Mathematics, effects: Effects, states: States, cable: Any, tension: Any) -> Any:
    """Rate of the free strain under an elastic tension, in 1/s."""
    total: Any = 0.0
    for active, effect_states in zip(effects, states):
        if active.effect.free_strain_rate is not None:
            total = total + active.effect.free_strain_rate(m, active.values, effect_states, cable, tension)
    return total


def sag(
    m: Mathematics, effects: Effects, cable: Any, line: Any, strain: Any, stiffness: Tuple[Any, Any]
) -> Tuple[Any, Any]:
    """``ln(arc / chord)`` of the rope, now and at the start; ``stiffness`` as the stage of that name gives it."""
    for active in effects:
        if active.effect.sag is not None:
            now, at_start = active.effect.sag(m, active.values, cable, line, strain, stiffness)
            return now, at_start
    return 0.0, 0.0


def rope_speed(m: Mathematics, effects: Effects, states: States, winch_speed: Any, tension: Any) -> Any:
    """Speed at which rope is reeled in, in m/s: the encoder speed and what the effects add to it."""
    speed = winch_speed
    for active, effect_states in zip(effects, states):
        if active.effect.rope_speed is not None:
            speed = speed + active.effect.rope_speed(m, active.values, effect_states, winch_speed, tension)
    return speed


def added_tension(m: Mathematics, effects: Effects, states: States, cable: Any, motion: Any) -> Any:
    """Tension beside that of the law, in N; ``cable`` has the constants that effects set."""
    total: Any = 0.0
    for active, effect_states in zip(effects, states):
        if active.effect.tension is not None:
            total = total + active.effect.tension(m, active.values, effect_states, cable, motion)
    return total


def carried_tension(m: Mathematics, effects: Effects, cable: Any, pull: Any) -> Any:
    """Tension that a rope carries where the law gives ``pull``; never negative, in N."""
    tension = m.maximum(pull, 0.0)
    for active in effects:
        if active.effect.softening is not None:
            tension = tension + active.effect.softening(m, active.values, cable, pull)
    return tension


def end_forces(m: Mathematics, effects: Effects, gravity: Any, line: Any, tension: Any) -> Tuple[Vector, Any]:
    """Forces at the ends beside the tension: a vector on the platform, and at the load cell; in N."""
    platform_force: Vector = (0.0, 0.0, 0.0)
    cell_tension: Any = 0.0
    for active in effects:
        if active.effect.ends is not None:
            force, tension_change = active.effect.ends(m, active.values, gravity, line, tension)
            platform_force = add(platform_force, force)
            cell_tension = cell_tension + tension_change
    return platform_force, cell_tension


def lateral_force(m: Mathematics, effects: Effects, line: Any) -> Vector:
    """Force across the rope on the platform, in N."""
    total: Vector = (0.0, 0.0, 0.0)
    for active in effects:
        if active.effect.lateral_force is not None:
            total = add(total, active.effect.lateral_force(m, active.values, line))
    return total


def transmission(m: Mathematics, effects: Effects, motion: Any) -> Tuple[Any, Any]:
    """Logarithms of the tensions at the platform and at the load cell over that of the span."""
    at_platform: Any = 0.0
    at_cell: Any = 0.0
    for active in effects:
        if active.effect.transmission is not None:
            first, second = active.effect.transmission(m, active.values, motion)
            at_platform = at_platform + first
            at_cell = at_cell + second
    return at_platform, at_cell


def sensor_gains(m: Mathematics, effects: Effects) -> Tuple[Any, Any]:
    """Sensor gains of measured tension and measured position."""
    tension: Any = 1.0
    position: Any = 1.0
    for active in effects:
        if active.effect.gain is not None:
            first, second = active.effect.gain(m, active.values)
            tension = tension * first
            position = position * second
    return tension, position


def sensor_offsets(m: Mathematics, effects: Effects) -> Tuple[Any, Vector]:
    """Sensor offsets of measured tension, in N, and of measured position, in m; they add to what the gains give."""
    tension: Any = 0.0
    position: Vector = (0.0, 0.0, 0.0)
    for active in effects:
        if active.effect.offset is not None:
            first, second = active.effect.offset(m, active.values)
            tension = tension + first
            position = add(position, second)
    return tension, position


def has_low_pass(effects: Effects) -> bool:
    """Whether a load cell has a low-pass filter."""
    return any(active.effect.low_pass is not None for active in effects)


def moves_states(m: Mathematics, effects: Effects) -> Any:
    """Positive where an effect has a state that moves; that of a load cell without a filter rests."""
    if any(active.effect.state_rates is not None for active in effects):
        return 1.0
    return sum(active.effect.low_pass(m, active.values) for active in effects if active.effect.low_pass is not None)


def low_pass(
    m: Mathematics, effects: Effects, states: States, tension: Any, reference: Tuple[Any, Any]
) -> Tuple[Any, Tuple[Tuple[Any, ...], ...]]:
    """Tension that load cells show behind low-pass filters of first order, in N, and the rates of the filters' states.

    ``tension`` is that at the cell. A filter's state is what it shows beside the tension at the start, over the rope's
    modulus times area: these two are the ``reference``.
    """
    start_tension, rigidity = reference
    rates: List[Tuple[Any, ...]] = []
    for active, effect_states in zip(effects, states):
        if active.effect.low_pass is None:
            rates.append(())
            continue
        time = active.effect.low_pass(m, active.values)
        shown = start_tension + rigidity * effect_states[0]
        # Without a filter the state rests; a time constant of zero must not divide.
        rate = (tension - shown) / (rigidity * m.maximum(time, SHORTEST_FILTER))
        rates.append((m.where(time, rate, 0.0),))
        tension = m.where(time, shown, tension)
    return tension, tuple(rates)


def sensor_delays(m: Mathematics, effects: Effects) -> Tuple[Any, Any]:
    """Sensor delays of measured tension and measured position, in s."""
    tension: Any = 0.0
    position: Any = 0.0
    for active in effects:
        if active.effect.delay is not None:
            first, second = active.effect.delay(m, active.values)
            tension = tension + first
            position = position + second
    return tension, position
