"""A cable from its exit point to the platform: length, strain, tension, and the force on the platform.

State: the unstrained length ``l_u`` and the wound length, the integral of the rope speed ``V``; and what the effects
remember. How the effects act on the way from motion to load cell: :class:`tautwire_fmu.laws.effects.Effect`.

    logarithmic law   T = E S ln(l / l_u) + c S (dl/dt + V) / l + T0,   dl_u/dt = -V l_u / l
    linear law        T = E S r / l       + c S (dl/dt + V) / l + T0,   r = l - l_u,  dl_u/dt = -V

``V`` is positive when the winch reels in; it takes up strained rope, hence ``l_u / l``. At the start ``l_u`` is the
length and ``T`` is ``T0``, so ``T0`` is what statics asks for there. A cable that would push carries nothing.

Source: Baklouti et al. 2017, Eqs. 1 to 4 and 12, with the reference length moving with the winch.
"""

from typing import Any, Callable, NamedTuple, Sequence, Tuple

from . import stages
from .effects import ActiveEffect
from .mathematics import Mathematics
from .vectors import Vector, add, dot, norm, scale, subtract


class TensionLaw(NamedTuple):
    """The two functions in which the tension laws differ."""

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
    """What the robot file declares of a cable, and its static start; SI units.

    ``start_direction`` and ``start_length`` are those of :func:`tautwire_fmu.laws.stages.route` at the start.
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


class CableState(NamedTuple):
    """What a cable remembers; ``effects`` holds one tuple an effect."""

    unstrained_length: Any
    wound_length: Any
    effects: Tuple[Tuple[Any, ...], ...]


class CableInputs(NamedTuple):
    """What acts on a cable from outside: the platform's motion and the winch speed."""

    position: Vector
    velocity: Vector
    winch_speed: Any


class Span(NamedTuple):
    """The rope between platform and exit point as if it did not sag; see :class:`tautwire_fmu.laws.stages.Route`."""

    direction: Vector
    length: Any
    chord: Any
    length_rate: Any


class CableMotion(NamedTuple):
    """The kinematics of a cable, as effects in the rope see them.

    ``strain`` is what the law acts on, ``elastic_tension`` what it gives without viscosity, in N; ``arc`` is the
    length of the rope with its sag, in m; ``winch_speed`` is the encoder's, ``rope_speed`` the rope's, in m/s.
    """

    line: Span
    winch_speed: Any
    rope_speed: Any
    arc: Any
    strain: Any
    strain_rate: Any
    elastic_tension: Any


class CableReading(NamedTuple):
    """What a cable shows: tension in N, force on the platform in N, lengths in m.

    ``tension`` is what the load cell shows, but for its lag; ``span_tension`` that of the free span; ``pull`` what
    the law asks for, negative where the cable hangs slack.
    """

    tension: Any
    span_tension: Any
    pull: Any
    force: Vector
    length: Any
    elongation: Any
    strain: Any


def simplified(
    m: Mathematics, cable: CableConstants, effects: Tuple[ActiveEffect, ...]
) -> Tuple[CableConstants, Tuple[ActiveEffect, ...]]:
    """A cable whose effects do nothing but set constants: with these, and no effects. Any other as it is."""
    if not effects or not all(active.effect.sets_constants for active in effects):
        return cable, effects
    modulus, _ = stages.stiffness(m, effects, [()] * len(effects), cable)
    return cable._replace(modulus=modulus, damping=stages.viscosity(m, effects, cable)), ()


def start_state(cable: CableConstants, effects: Sequence[ActiveEffect]) -> CableState:
    """The state at the static start: nothing wound, the unstrained length equal to the length."""
    return CableState(
        unstrained_length=cable.start_length,
        wound_length=0.0,
        effects=tuple((0.0,) * len(active.effect.states) for active in effects),
    )


def span(m: Mathematics, cable: CableConstants, inputs: CableInputs, effects: Sequence[ActiveEffect] = ()) -> Span:
    """Length, its rate and direction; they depend on the platform's motion alone."""
    if effects:
        direction, length, chord = stages.route(m, effects, cable.anchor, inputs.position)
    else:
        line = subtract(cable.anchor, inputs.position)
        length = chord = norm(m, line)
        direction = scale(1.0 / length, line)
    return Span(direction, length, chord, -dot(direction, inputs.velocity))


def motion(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    line: Span,
    winch_speed: Any,
) -> CableMotion:
    """Strain and its rate on a span."""
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
    own = state.effects
    modulus, stress = stages.stiffness(m, effects, own, cable)
    strain = strain - stages.free_strain(m, effects, own)
    sag, sag_before = stages.sag(m, effects, cable, line, strain, modulus, stress)
    strain = strain + (sag - sag_before)
    arc = line.length * m.exp(sag)
    elastic = cable.area * (modulus * strain + stress) + cable.start_tension
    speed = stages.rope_speed(m, effects, own, winch_speed, elastic)
    free_rate = stages.free_strain_rate(m, effects, own, cable, elastic)
    return CableMotion(line, winch_speed, speed, arc, strain, (line.length_rate + speed) / arc - free_rate, elastic)


def state_rates(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    moving: CableMotion,
) -> CableState:
    """Time derivative of the state, in the shape of the state."""
    return CableState(
        unstrained_length=cable.law.unstrained_length_rate(m, moving.rope_speed, moving.arc, state.unstrained_length),
        wound_length=moving.rope_speed,
        effects=tuple(
            () if active.effect.state_rates is None else active.effect.state_rates(m, active.values, own, cable, moving)
            for active, own in zip(effects, state.effects)
        ),
    )


def reading(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    moving: CableMotion,
) -> CableReading:
    """Tensions, force on the platform, length, elongation and strain.

    ``elongation`` is the paper's ``r = l - (l_0 - integral V dt)`` (Eq. 4). Not ``l - l_u``: under the logarithmic
    law the winch has taken up strained rope, and the two part by that stretch.
    """
    line = moving.line
    if effects:
        damping = stages.viscosity(m, effects, cable)
        pull = moving.elastic_tension + cable.area * (damping * moving.strain_rate)
        pull = pull + stages.added_tension(m, effects, state.effects, cable, moving)
        tension = stages.carried(m, effects, cable, pull)
        at_platform, at_cell = stages.transmission(m, effects, moving)
        on_platform, more = stages.ends(m, effects, cable.gravity, line, tension)
        force = add(scale(tension * m.exp(at_platform), line.direction), on_platform)
        shown = (tension + more) * m.exp(at_cell) * stages.gains(m, effects)[0]
    else:
        pull = moving.elastic_tension + cable.area * (cable.damping * moving.strain_rate)
        shown = tension = m.maximum(pull, 0.0)
        force = scale(tension, line.direction)
    return CableReading(
        tension=shown,
        span_tension=tension,
        pull=pull,
        force=force,
        length=line.length,
        elongation=line.length - (cable.start_length - state.wound_length),
        strain=moving.strain,
    )
