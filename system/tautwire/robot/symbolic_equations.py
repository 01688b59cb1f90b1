"""Equations of motion of a robot as CasADi expressions, made from the laws: rates, outputs, and states of effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effects import State
from tautwire_fmu.laws.formula import ELAPSED_TIME
from tautwire_fmu.laws.formula import FORMULA_EFFECT_NAME as FORMULA_NAME
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.vectors import add, scale

from .platform_symbols import PlatformSymbols, vector_of
from .robot_assembly import RobotAssembly

CASADI_MATHEMATICS = Mathematics(
    log=casadi.log,
    exp=casadi.exp,
    sqrt=casadi.sqrt,
    sin=casadi.sin,
    cos=casadi.cos,
    tanh=casadi.tanh,
    atan2=casadi.atan2,
    absolute=casadi.fabs,
    maximum=casadi.fmax,
    where=lambda condition, a, b: casadi.if_else(condition > 0, a, b),
)


@dataclass(frozen=True)
class MechanicalVariables:
    """The mechanical states, and the inputs, as symbols.

    ``length_shifts`` (n) are what unstrained lengths are longer than their states: a state starts at the length that
    the declared anchors give, whatever the uncertain ones are.
    """

    platform: PlatformSymbols
    unstrained_lengths: SX
    winch_speeds: SX
    length_shifts: SX

    @property
    def states(self) -> SX:
        """Pose and twist of the platform, and unstrained lengths."""
        return casadi.vertcat(self.platform.pose, self.platform.twist, self.unstrained_lengths)

    @property
    def inputs(self) -> SX:
        """Winch speeds and external wrench."""
        return casadi.vertcat(self.winch_speeds, self.platform.external_wrench)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the mechanical states."""
        lengths = _numbered_names("unstrained_length", self.cable_count)
        return (*self.platform.pose_names, *self.platform.twist_names, *lengths)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return (*_numbered_names("winch_speed", self.cable_count), *self.platform.wrench_names)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        tensions, lengths = (_numbered_names(name, self.cable_count) for name in ("tension", "length"))
        return (*self.platform.pose_names, *self.platform.twist_names, *tensions, *lengths)

    @property
    def cable_count(self) -> int:
        """Number n of cables."""
        return int(self.winch_speeds.numel())


@dataclass(frozen=True)
class Equations:
    """Rates of the mechanical states and of those of effects, outputs, and tensions of the free spans."""

    rates: SX
    outputs: SX
    span_tensions: SX


@dataclass(frozen=True)
class EffectState:
    """A state of an effect with its symbol; ``cable`` counts from 1, 0 for the platform."""

    effect: str
    cable: int
    state: State
    symbol: SX

    @property
    def name(self) -> str:
        """The effect's name, the state's, and the cable's number."""
        return f"{self.effect}.{self.state.name}_{self.cable}" if self.cable else f"{self.effect}.{self.state.name}"


def _effect_states(assembly: RobotAssembly) -> list[EffectState]:
    """States of effects of the cables, then of the platform; all formulas share one time state."""
    components = [
        *enumerate((component.effects for component in assembly.cables), start=1),
        (0, assembly.platform_effects),
    ]
    effect_states = [
        EffectState(active.effect.name, index, state, SX.sym(state.name))
        for index, effects in components
        for active in effects
        for state in active.effect.states
    ]
    time = EffectState(FORMULA_NAME, 0, ELAPSED_TIME, SX.sym(ELAPSED_TIME.name))
    return [time if (each.effect, each.state) == (FORMULA_NAME, ELAPSED_TIME) else each for each in effect_states]


def minimal_equations(assembly: RobotAssembly, variables: MechanicalVariables) -> tuple[list[EffectState], Equations]:
    """The equations with those states of effects alone, each once, that influence an output; and these states."""
    effect_states = _effect_states(assembly)
    equations = _equations(assembly, variables, [each.symbol for each in effect_states])
    mechanical_count = variables.states.numel()

    def select(indices: Sequence[int]) -> tuple[list[EffectState], Equations]:
        rows = [*range(mechanical_count), *(mechanical_count + index for index in indices)]
        return [effect_states[index] for index in indices], replace(equations, rates=equations.rates[rows])

    # By identity: symbols have no truth value where an effect is listed twice.
    seen = [any(each is other for other in effect_states[:i]) for i, each in enumerate(effect_states)]
    effect_states, equations = select([i for i, is_repeated in enumerate(seen) if not is_repeated])
    states = casadi.vertcat(variables.states, *(each.symbol for each in effect_states))
    return select(_relevant_effect_states(states, mechanical_count, equations))


def _relevant_effect_states(states: SX, mechanical_count: int, equations: Equations) -> list[int]:
    """Indices of the effect states that influence an output, directly or through other states."""
    outputs = casadi.vertcat(equations.outputs, equations.span_tensions)
    rate_pattern, output_pattern = (_nonzero_pattern(casadi.jacobian(f, states)) for f in (equations.rates, outputs))
    relevant: NDArray[np.bool_] = np.any(output_pattern, axis=0) | (np.arange(states.numel()) < mechanical_count)
    for _ in range(len(relevant)):
        relevant = relevant | np.any(rate_pattern[relevant], axis=0)
    return np.flatnonzero(relevant[mechanical_count:]).tolist()


def _nonzero_pattern(matrix: SX) -> NDArray[np.bool_]:
    """Sparsity pattern of a matrix."""
    pattern: NDArray[np.bool_] = np.array(casadi.DM(matrix.sparsity(), 1.0), dtype=bool)
    return pattern


def _equations(assembly: RobotAssembly, variables: MechanicalVariables, effect_states: list[SX]) -> Equations:
    readings = []
    cable_rates = []
    effect_rates: list[SX] = []
    symbols, platform = iter(effect_states), variables.platform
    for index, component in enumerate(assembly.cables):
        states = tuple(tuple(next(symbols) for _ in a.effect.states) for a in component.effects)
        unstrained_length = variables.unstrained_lengths[index] + variables.length_shifts[index]
        state = cable_law.CableState(unstrained_length, 0.0, states)
        inputs = cable_law.CableInputs(*platform.attachment_motion(index), variables.winch_speeds[index])
        arguments = (CASADI_MATHEMATICS, component.constants, component.effects, state)
        span = cable_law.span(CASADI_MATHEMATICS, component.constants, inputs, component.effects)
        motion = cable_law.cable_motion(*arguments, span, inputs.winch_speed)
        rate = cable_law.state_rates(*arguments, motion)
        readings.append(cable_law.cable_outputs(*arguments, motion))
        cable_rates.append(rate.unstrained_length)
        effect_rates += [r for rates in rate.effects for r in rates]
    platform_states = tuple(tuple(next(symbols) for _ in a.effect.states) for a in assembly.platform_effects)
    # On the platform only formulas have states: the time since the start.
    effect_rates += [SX(1.0) for states in platform_states for _ in states]
    effects = assembly.platform_effects
    measured = scale(stages.sensor_gains(CASADI_MATHEMATICS, effects)[1], vector_of(platform.pose))
    measured = add(measured, stages.sensor_offsets(CASADI_MATHEMATICS, effects)[1])
    platform_rates = platform.rates([reading.force for reading in readings], effects, platform_states)
    return Equations(
        rates=casadi.vertcat(platform_rates, *cable_rates, *effect_rates),
        outputs=casadi.vertcat(
            *measured,
            platform.pose[3:],
            platform.twist,
            *(r.tension for r in readings),
            *(r.length for r in readings),
        ),
        span_tensions=casadi.vertcat(*(r.span_tension for r in readings)),
    )


def _numbered_names(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{index}" for index in range(1, count + 1))
