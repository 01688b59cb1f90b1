"""What an effect is: data and a few functions, each for the stage where the effect acts."""

from typing import Any, Callable, NamedTuple, Optional, Tuple


class Parameter(NamedTuple):
    """One number of an effect.

    ``neutral`` is the value at which the effect is exactly absent; None where that is the value that the robot
    file declares for the cable under the key of the same name. Fits begin at ``start_ratio`` times the declared
    value, or at ``start`` where nothing or zero is declared; neither is the neutral value.
    """

    name: str
    unit: str
    description: str
    minimum: float
    maximum: float
    neutral: Optional[float]
    start: float
    start_ratio: float = 1.0


class State(NamedTuple):
    """One state of an effect; it starts at zero."""

    name: str
    unit: str
    description: str


class Effect(NamedTuple):
    """A physical effect that the plain robot lacks.

    Stages, each a function or None where the effect does not act there. Contributions of one stage add up (speeds,
    tensions, masses, forces), so the order of effects never matters.

    ============== ======================================================== =======================
    stage          call                                                     gives
    ============== ======================================================== =======================
    ``rope_speed`` ``(m, values, states, winch_speed)``                     m/s, added at the winch
    ``tension``    ``(m, values, states, cable, motion)``                   N, added in the rope
    ``inertia``    ``(m, values)``                                          kg, added on the platform
    ``wrench``     ``(m, values, states, position, velocity)``              N, vector on the platform
    ============== ======================================================== =======================

    ``values`` is the class of the parameters (a NamedTuple, one field a parameter, in order); ``state_rates`` has
    the arguments of the stage and gives a tuple, one rate a state.
    """

    name: str
    component: str
    description: str
    parameters: Tuple[Parameter, ...]
    values: Callable[..., Any]
    source: str
    states: Tuple[State, ...] = ()
    state_rates: Optional[Callable[..., Any]] = None
    rope_speed: Optional[Callable[..., Any]] = None
    tension: Optional[Callable[..., Any]] = None
    inertia: Optional[Callable[..., Any]] = None
    wrench: Optional[Callable[..., Any]] = None


class ActiveEffect(NamedTuple):
    """An effect with its numbers, as it acts on one component."""

    effect: Effect
    values: Any
