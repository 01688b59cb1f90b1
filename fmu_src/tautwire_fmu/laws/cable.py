"""A cable from its exit point to the platform: length, strain, tension, and the force on the platform.

State: the unstrained length ``l_u`` and the wound length, the integral of the rope speed ``V``.

    logarithmic law   T = E S ln(l / l_u) + c S (dl/dt + V) / l + T0,   dl_u/dt = -V l_u / l
    linear law        T = E S r / l       + c S (dl/dt + V) / l + T0,   r = l - l_u,  dl_u/dt = -V

``V`` is positive when the winch reels in; it takes up strained rope, hence ``l_u / l``. At the start ``l_u`` is the
length and ``T`` is ``T0``, so ``T0`` is what statics asks for there. A cable that would push carries nothing.

Source: Baklouti et al. 2017, Eqs. 1 to 4 and 12, with the reference length moving with the winch.
"""

from typing import Any, Callable, NamedTuple, Sequence, Tuple

from .effects import ActiveEffect
from .mathematics import Mathematics
from .vectors import Vector, dot, norm, scale, subtract
from .winch import rope_speed


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
    """What the robot file declares of a cable; SI units."""

    law: TensionLaw
    anchor: Vector
    modulus: Any
    area: Any
    damping: Any
    start_length: Any
    start_tension: Any


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
    """The straight line from the platform to the exit point; ``direction`` is its unit vector."""

    direction: Vector
    length: Any
    length_rate: Any


class CableMotion(NamedTuple):
    """The kinematics of a cable, as effects in the rope see them."""

    direction: Vector
    length: Any
    length_rate: Any
    rope_speed: Any
    strain: Any
    strain_rate: Any


class CableReading(NamedTuple):
    """What a cable shows: tension in N, force on the platform in N, lengths in m.

    ``pull`` is the tension that the law asks for, in N: negative where the cable hangs slack.
    """

    tension: Any
    pull: Any
    force: Vector
    length: Any
    elongation: Any
    strain: Any


def start_state(cable: CableConstants, effects: Sequence[ActiveEffect]) -> CableState:
    """The state at the static start: nothing wound, the unstrained length equal to the length."""
    return CableState(
        unstrained_length=cable.start_length,
        wound_length=0.0,
        effects=tuple((0.0,) * len(active.effect.states) for active in effects),
    )


def span(m: Mathematics, cable: CableConstants, inputs: CableInputs) -> Span:
    """Length, its rate and direction; they depend on the platform's motion alone."""
    line = subtract(cable.anchor, inputs.position)
    length = norm(m, line)
    direction = scale(1.0 / length, line)
    return Span(direction, length, -dot(direction, inputs.velocity))


def motion(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    line: Span,
    winch_speed: Any,
) -> CableMotion:
    """Strain and its rate on a span."""
    speed = rope_speed(m, effects, state.effects, winch_speed)
    return CableMotion(
        direction=line.direction,
        length=line.length,
        length_rate=line.length_rate,
        rope_speed=speed,
        strain=cable.law.strain(m, line.length, state.unstrained_length),
        strain_rate=(line.length_rate + speed) / line.length,
    )


def state_rates(
    m: Mathematics,
    cable: CableConstants,
    effects: Sequence[ActiveEffect],
    state: CableState,
    moving: CableMotion,
) -> CableState:
    """Time derivative of the state, in the shape of the state."""
    return CableState(
        unstrained_length=cable.law.unstrained_length_rate(
            m, moving.rope_speed, moving.length, state.unstrained_length
        ),
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
    """Tension, force on the platform, length, elongation and strain.

    ``elongation`` is the paper's ``r = l - (l_0 - integral V dt)`` (Eq. 4). Not ``l - l_u``: under the logarithmic
    law the winch has taken up strained rope, and the two part by that stretch.
    """
    pull = cable.area * (cable.modulus * moving.strain + cable.damping * moving.strain_rate) + cable.start_tension
    for active, own in zip(effects, state.effects):
        if active.effect.tension is not None:
            pull = pull + active.effect.tension(m, active.values, own, cable, moving)
    tension = m.maximum(pull, 0.0)
    return CableReading(
        tension=tension,
        pull=pull,
        force=scale(tension, moving.direction),
        length=moving.length,
        elongation=moving.length - (cable.start_length - state.wound_length),
        strain=moving.strain,
    )
