"""Cable law from the exit point to the platform: length, strain, tension, and the force on the platform.

State: the unstrained length ``l_u``, the wound length (the integral of the rope speed ``V``), and the states of the
effects. How the effects act on the way from motion to load cell: :class:`tautwire_fmu.laws.effects.Effect`.

    logarithmic law   T = E S ln(l / l_u) + c S (dl/dt + V) / l + T0,   dl_u/dt = -V l_u / l
    linear law        T = E S r / l       + c S (dl/dt + V) / l + T0,   r = l - l_u,  dl_u/dt = -V

``V`` is positive when the winch reels in; it takes up strained rope, hence ``l_u / l``. At the start ``l_u`` is the
length and ``T`` is ``T0``, so ``T0`` is the static tension there. A cable that would push carries no tension.

Source: Baklouti et al. 2017, Eqs. 1 to 4 and 12, with the reference length moving with the winch.
"""

from typing import Any, Callable, NamedTuple, Sequence, Tuple

from . import effect_stages as stages
from .effects import ActiveEffect
from .mathematics import Mathematics
from .vectors import Vector, add, dot, norm, scale, subtract


class TensionLaw(NamedTuple):
    """Tension law: the two functions in which the laws differ."""

    strain: Callable[[Mathematics, Any, Any], Any]
    unstrained_length_rate: Callable[[Mathematics, Any, Any, Any], Any]


def _logarithmic_strain(m: Mathematics, length: Any, unstrained_length: Any) -> Any:
    return m.log(length / unstrained_length)


def _logarithmic_rate(m: Mathematics, speed: Any, length: Any, unstrained_length: Any) -> Any:
    return -speed * unstrained_length / length


def _linear_strain(m: Mathematics, length: Any, unstrained_length: Any) -> Any:
    return (length - unstrained_length) / length


def _linear_rate(m: Mathematics, speed: Any, length: Any, unstrained_length: Any) -> Any:
    return -speed


LOGARITHMIC = TensionLaw(_logarithmic_strain, _logarithmic_rate)
LINEAR = TensionLaw(_linear_strain, _linear_rate)
LAWS = {"logarithmic": LOGARITHMIC, "linear": LINEAR}


class CableConstants(NamedTuple):
    """Constants of a cable by the robot file, and its static start; SI units.

    ``start_direction`` and ``start_length`` are those of :func:`tautwire_fmu.laws.effect_stages.route` at the start,
    ``swivel_axis`` is the unit vector that it takes. ``start_cell_tension`` is that at the load cell then, where its
    low-pass filter begins; see :func:`with_start_cell_tension`.
    """

    law: TensionLaw
    anchor: Vector
    modulus: Any
    area: Any
    damping: Any
    start_length: Any
    start_tension: Any
    start_direction: Vector
    gravity: Any
    swivel_axis: Vector = stages.VERTICAL
    start_cell_tension: Any = 0.0


class CableState(NamedTuple):
    """State of a cable; ``effects`` holds one tuple an effect."""

    unstrained_length: Any
    wound_length: Any
    effects: Tuple[Tuple[Any, ...], ...]


class CableInputs(NamedTuple):
    """Inputs of a cable: the platform's motion and the winch speed."""

    position: Vector
    velocity: Vector
    winch_speed: Any


class Span(NamedTuple):
    """Free span between platform and exit point, without sag; see :class:`tautwire_fmu.laws.effect_stages.Route`.

    ``velocity`` is that of its end at the platform.
    """

    direction: Vector
    length: Any
    chord: Any
    length_rate: Any
    velocity: Vector


class CableMotion(NamedTuple):
    """Kinematics of a cable, as passed to the effects in the rope.

    ``strain`` is the argument of the law, ``elastic_tension`` its value without viscosity, in N; ``arc`` is the
    length of the rope with its sag, in m; ``winch_speed`` is the encoder's, ``rope_speed`` the rope's, in m/s.
    """

    line: Span
    winch_speed: Any
    rope_speed: Any
    arc: Any
    strain: Any
    strain_rate: Any
    elastic_tension: Any


class CableOutputs(NamedTuple):
    """Outputs of a cable: tension in N, force on the platform in N, lengths in m.

    ``tension`` is that at the load cell, behind its low-pass filter and without its delay; ``span_tension`` that of the
    free span; ``pull`` the value of the tension law, negative where the cable hangs slack.
    """

    tension: Any
    span_tension: Any
    pull: Any
    force: Vector
    length: Any
    elongation: Any
    strain: Any


def fold_constant_effects(
    m: Mathematics, cable: CableConstants, effects: Tuple[ActiveEffect, ...]
) -> Tuple[CableConstants, Tuple[ActiveEffect, ...]]:
    """Fold effects that only set constants into the constants of a cable, which then has no effects.

    Any other cable is returned as it is."""
    if not effects or not all(active.effect.only_sets_constants for active in effects):
        return cable, effects
    return _with_effective_constants(m, cable, effects), ()


def _with_effective_constants(m: Mathematics, cable: CableConstants, effects: Sequence[ActiveEffect]) -> CableConstants:
    """The cable with the modulus and damping that effects set; with a relaxation the modulus is the long-term one."""
    constant = [active for active in effects if active.effect.only_sets_constants]
    modulus, _ = stages.stiffness(m, constant, [()] * len(constant), cable)
    return cable._replace(modulus=modulus, damping=stages.viscosity(m, constant, cable))


def start_state(cable: CableConstants, effects: Sequence[ActiveEffect]) -> CableState:
    """State at the static start: nothing wound, the unstrained length equal to the length."""
    return CableState(
        unstrained_length=cable.start_length,
        wound_length=0.0,
        effects=tuple((0.0,) * len(active.effect.states) for active in effects),
    )


def with_start_cell_tension(
    m: Mathematics, cable: CableConstants, effects: Sequence[ActiveEffect], chord: Any
) -> CableConstants:
    """The constants of a cable with the tension at its load cell at the start, where that has a low-pass filter.

    ``chord`` is the straight distance then, in m.
    """
    if not stages.has_low_pass(effects):
        return cable
    line = Span(cable.start_direction, cable.start_length, chord, 0.0, (0.0, 0.0, 0.0))
    at_rest = start_state(cable, effects)
    motion = cable_motion(m, cable, effects, at_rest, line, 0.0)
    return cable._replace(start_cell_tension=_cell_tension(m, cable, effects, at_rest, motion))


def span(m: Mathematics, cable: CableConstants, inputs: CableInputs, effects: Sequence[ActiveEffect] = ()) -> Span:
    """Length, length rate and direction of the span; they depend on the platform's motion alone."""
    if effects:
        direction, length, chord = stages.route(m, effects, cable.anchor, inputs.position, cable.swivel_axis)
    else:
        line = subtract(cable.anchor, inputs.position)
        length = chord = norm(m, line)
        direction = scale(1.0 / length, line)
    return Span(direction, length, chord, -dot(direction, inputs.velocity), inputs.velocity)


def cable_motion(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    line: Span,
    winch_speed: Any,
) -> CableMotion:
    """Strain, its rate and the elastic tension on a span."""
    strain = cable.law.strain(m, line.length, state.unstrained_length)
    if not effects:
        return CableMotion(
            line,
            winch_speed,
            winch_speed,
            line.length,
            strain,
            (line.length_rate + winch_speed) / line.length,
            cable.area * (cable.modulus * strain) + cable.start_tension,
        )
    effect_states = state.effects
    modulus, stress = stiffness = stages.stiffness(m, effects, effect_states, cable)
    strain = strain - stages.free_strain(m, effects, effect_states)
    sag, start_sag = stages.sag(m, effects, cable, line, strain, stiffness)
    strain = strain + (sag - start_sag)
    arc = line.length * m.exp(sag)
    elastic_tension = cable.area * (modulus * strain + stress) + cable.start_tension
    rope_speed = stages.rope_speed(m, effects, effect_states, winch_speed, elastic_tension)
    free_rate = stages.free_strain_rate(m, effects, effect_states, cable, elastic_tension)
    return CableMotion(
        line, winch_speed, rope_speed, arc, strain, (line.length_rate + rope_speed) / arc - free_rate, elastic_tension
    )


def state_rates(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    motion: CableMotion,
) -> CableState:
    """Time derivative of the state, in the shape of the state."""
    effect_rates = tuple(
        () if active.effect.state_rates is None else active.effect.state_rates(m, active.values, own, cable, motion)
        for active, own in zip(effects, state.effects)
    )
    if stages.has_low_pass(effects):
        cell_tension = _cell_tension(m, cable, effects, state, motion)
        _, filter_rates = _filtered(m, cable, effects, state, cell_tension)
        effect_rates = tuple(own or filtered for own, filtered in zip(effect_rates, filter_rates))
    return CableState(
        unstrained_length=cable.law.unstrained_length_rate(m, motion.rope_speed, motion.arc, state.unstrained_length),
        wound_length=motion.rope_speed,
        effects=effect_rates,
    )


def cable_outputs(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    motion: CableMotion,
) -> CableOutputs:
    """Outputs of a cable: tensions, force on the platform, length, elongation and strain.

    ``elongation`` is the paper's ``r = l - (l_0 - integral V dt)`` (Eq. 4). Not ``l - l_u``: under the logarithmic
    law the winch has taken up strained rope, and the two differ by that stretch.
    """
    line = motion.line
    pull, tension = _span_tension(m, cable, effects, state, motion)
    if effects:
        force, cell_tension = _end_forces(m, cable, effects, motion, tension)
        if stages.has_low_pass(effects):
            cell_tension, _ = _filtered(m, cable, effects, state, cell_tension)
        measured_tension = cell_tension * stages.sensor_gains(m, effects)[0] + stages.sensor_offsets(m, effects)[0]
    else:
        measured_tension = tension
        force = scale(tension, line.direction)
    return CableOutputs(
        tension=measured_tension,
        span_tension=tension,
        pull=pull,
        force=force,
        length=line.length,
        elongation=line.length - (cable.start_length - state.wound_length),
        strain=motion.strain,
    )


def _span_tension(
    m: Mathematics, cable: CableConstants, effects: Sequence[ActiveEffect], state: CableState, motion: CableMotion
) -> Tuple[Any, Any]:
    """Value of the tension law, and the tension of the free span, in N."""
    if not effects:
        pull = motion.elastic_tension + cable.area * (cable.damping * motion.strain_rate)
        return pull, m.maximum(pull, 0.0)
    damping = stages.viscosity(m, effects, cable)
    pull = motion.elastic_tension + cable.area * (damping * motion.strain_rate)
    effective = _with_effective_constants(m, cable, effects)
    pull = pull + stages.added_tension(m, effects, state.effects, effective, motion)
    return pull, stages.carried_tension(m, effects, cable, pull)


def _end_forces(
    m: Mathematics, cable: CableConstants, effects: Sequence[ActiveEffect], motion: CableMotion, tension: Any
) -> Tuple[Vector, Any]:
    """Forces of a span under a tension on the platform, and at the load cell, in N."""
    line = motion.line
    log_platform_ratio, log_cell_ratio = stages.transmission(m, effects, motion)
    end_force, end_tension = stages.end_forces(m, effects, cable.gravity, line, tension)
    force = add(scale(tension * m.exp(log_platform_ratio), line.direction), end_force)
    return add(force, stages.lateral_force(m, effects, line)), (tension + end_tension) * m.exp(log_cell_ratio)


def _cell_tension(
    m: Mathematics, cable: CableConstants, effects: Sequence[ActiveEffect], state: CableState, motion: CableMotion
) -> Any:
    """Tension at the load cell before its low-pass filter, in N."""
    _, tension = _span_tension(m, cable, effects, state, motion)
    return _end_forces(m, cable, effects, motion, tension)[1]


def _filtered(
    m: Mathematics, cable: CableConstants, effects: Sequence[ActiveEffect], state: CableState, cell_tension: Any
) -> Tuple[Any, Tuple[Tuple[Any, ...], ...]]:
    """Tension behind the load cell's low-pass filters, and the rates of their states."""
    reference = (cable.start_cell_tension, cable.modulus * cable.area)
    return stages.low_pass(m, effects, state.effects, cell_tension, reference)
