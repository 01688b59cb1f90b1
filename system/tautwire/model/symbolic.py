"""The whole robot as one CasADi expression, made from the laws: for exact derivatives and compiled fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws import point_mass as platform_law
from tautwire_fmu.laws import stages
from tautwire_fmu.laws.effects import State
from tautwire_fmu.laws.formula import NAME as FORMULA_NAME
from tautwire_fmu.laws.formula import TIME
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.vectors import add, scale

from ..robots.robot import EffectSetting, Robot
from .assembly import Assembly, assemble
from .start_tensions import start_tensions
from .uncertain import AXES, UncertainNumber, offsets, with_moves

Array = NDArray[np.float64]

# In the place of an effect's setting: a number of the formulas.
OF_FORMULAS = -1

CASADI = Mathematics(
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
class FreeParameter:
    """A parameter of an effect of the robot that stays a symbol; ``setting`` counts the robot's effects from 0.

    It is OF_FORMULAS for a number of the formulas.
    """

    setting: int
    name: str


@dataclass(frozen=True)
class Model:
    """The equations of a robot; SX columns.

    States: position, velocity, unstrained lengths, and those states of effects that something depends on. Inputs:
    winch speeds, external force. Outputs: position and tensions as sensors show them but for their lag, velocity,
    lengths. ``lags`` (3 + n) of positions and tensions in s; ``span_tensions`` (n) those of the free ropes in N.
    ``start`` is the state at the static start; ``drifting`` are the places of states that never settle;
    ``parameters`` are the free ones.
    """

    states: SX
    inputs: SX
    parameters: SX
    rates: SX
    outputs: SX
    span_tensions: SX
    lags: SX
    start: SX
    drifting: tuple[int, ...]
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]


@dataclass(frozen=True)
class _Equations:
    rates: SX
    outputs: SX
    span_tensions: SX


@dataclass(frozen=True)
class _EffectState:
    """A state of an effect with its symbol; ``cable`` counts from 1 and is 0 on the platform."""

    effect: str
    cable: int
    state: State
    symbol: SX

    @property
    def name(self) -> str:
        return f"{self.effect}.{self.state.name}_{self.cable}" if self.cable else f"{self.effect}.{self.state.name}"


def symbolic_model(
    robot: Robot, free: Sequence[FreeParameter] = (), uncertain: Sequence[UncertainNumber] = ()
) -> Model:
    """Assemble the equations of a robot with some parameters of its effects left free.

    Each ``uncertain`` number is one more state, after all others: in standard deviations, zero at the start.
    The static start follows the free parameters; with more than three cables, cables at a tension limit stay there.
    Not valid across a change of which cables are at a limit.
    """
    symbols = [SX.sym(f"{_owner(robot, f)}.{f.name}") for f in free]
    moves = [SX.sym(number.label) for number in uncertain]
    opened = _with_symbols(with_moves(robot, uncertain, moves), free, symbols)
    assembly = assemble(opened, start_tensions(robot, opened, CASADI), CASADI)
    count = len(assembly.cables)
    position, velocity = SX.sym("position", 3), SX.sym("velocity", 3)
    unstrained = SX.sym("unstrained_length", count)
    speeds, external = SX.sym("winch_speed", count), SX.sym("external_force", 3)
    own = _effect_states(assembly)
    equations = _equations(assembly, position, velocity, unstrained, speeds, external, [e.symbol for e in own])
    always = casadi.vertcat(position, velocity, unstrained)
    once = [place for place, state in enumerate(own) if state not in own[:place]]
    own = [own[place] for place in once]
    rows = [*range(always.numel()), *(always.numel() + place for place in once)]
    equations = replace(equations, rates=equations.rates[rows])
    kept = _felt(casadi.vertcat(always, *(e.symbol for e in own)), always.numel(), equations)
    lengths = [SX(c.constants.start_length) for c in assembly.cables]
    begun = casadi.vertcat(SX(list(assembly.start)), SX(list(assembly.velocity)), *lengths, SX(len(kept), 1))
    shown_off = casadi.vertcat(*map(SX, offsets(uncertain, moves, count)))
    return Model(
        states=casadi.vertcat(always, *(own[place].symbol for place in kept), *moves),
        inputs=casadi.vertcat(speeds, external),
        parameters=casadi.vertcat(*symbols) if symbols else SX(0, 1),
        rates=casadi.vertcat(
            equations.rates[[*range(always.numel()), *(always.numel() + place for place in kept)]], SX(len(moves), 1)
        ),
        outputs=equations.outputs + casadi.vertcat(shown_off[:3], SX(3, 1), shown_off[3:], SX(count, 1)),
        span_tensions=equations.span_tensions,
        lags=_lags(assembly),
        start=casadi.vertcat(_at_rest(begun, moves), SX(len(moves), 1)),
        drifting=tuple(always.numel() + i for i, place in enumerate(kept) if own[place].state.drifts),
        state_names=(
            *_vector("position"),
            *_vector("velocity"),
            *_numbered("unstrained_length", count),
            *(own[place].name for place in kept),
            *(f"uncertain {number.label}" for number in uncertain),
        ),
        input_names=(*_numbered("winch_speed", count), *_vector("external_force")),
        output_names=(
            *_vector("position"),
            *_vector("velocity"),
            *_numbered("tension", count),
            *_numbered("length", count),
        ),
    )


def _at_rest(start: SX, moves: Sequence[SX]) -> SX:
    """The start's states by what is declared, whatever the uncertain numbers are."""
    return casadi.substitute(start, casadi.vertcat(*moves), SX.zeros(len(moves), 1)) if moves else start


def with_drifts_held(model: Model) -> Model:
    """The model without the states that never settle, which stay as they are at the start."""
    if not model.drifting:
        return model
    settling = [place for place in range(model.states.numel()) if place not in model.drifting]
    held = model.states[list(model.drifting)]
    expressions = [model.rates[settling], model.outputs, model.span_tensions]
    rates, outputs, tensions = casadi.substitute(expressions, [held], [SX.zeros(*held.shape)])
    return replace(
        model,
        states=model.states[settling],
        rates=rates,
        outputs=outputs,
        span_tensions=tensions,
        start=model.start[settling],
        drifting=(),
        state_names=tuple(model.state_names[place] for place in settling),
    )


def _effect_states(assembly: Assembly) -> list[_EffectState]:
    """Those of the cables, then those of the platform; the time of all formulas is one state."""
    parts = [*enumerate((component.effects for component in assembly.cables), start=1), (0, assembly.platform_effects)]
    found = [
        _EffectState(active.effect.name, index, state, SX.sym(state.name))
        for index, effects in parts
        for active in effects
        for state in active.effect.states
    ]
    time = _EffectState(FORMULA_NAME, 0, TIME, SX.sym(TIME.name))
    return [time if (each.effect, each.state) == (FORMULA_NAME, TIME) else each for each in found]


def _felt(states: SX, always: int, equations: _Equations) -> list[int]:
    """Which states of effects reach an output or the other states, counted among the states of effects."""
    shown = casadi.vertcat(equations.outputs, equations.span_tensions)
    by_rates, by_shown = (_present(casadi.jacobian(f, states)) for f in (equations.rates, shown))
    felt: NDArray[np.bool_] = np.any(by_shown, axis=0) | (np.arange(states.numel()) < always)
    for _ in range(len(felt)):
        felt = felt | np.any(by_rates[felt], axis=0)
    return np.flatnonzero(felt[always:]).tolist()


def _present(matrix: SX) -> NDArray[np.bool_]:
    """Where a matrix has entries at all."""
    found: NDArray[np.bool_] = np.array(casadi.DM(matrix.sparsity(), 1.0), dtype=bool)
    return found


def _with_symbols(robot: Robot, free: Sequence[FreeParameter], symbols: Sequence[SX]) -> Robot:
    effects = list(robot.effects)
    numbers: dict[str, Any] = {
        p.name: symbol for p, symbol in zip(free, symbols, strict=True) if p.setting == OF_FORMULAS
    }
    formulas = [
        replace(f, numbers={name: numbers.get(name, value) for name, value in f.numbers.items()})
        for f in robot.formulas
    ]
    for parameter, symbol in zip(free, symbols, strict=True):
        if parameter.setting == OF_FORMULAS:
            continue
        old = effects[parameter.setting]
        values: dict[str, Any] = {**old.values, parameter.name: symbol}
        effects[parameter.setting] = EffectSetting(old.name, values, old.cables)
    return replace(robot, effects=tuple(effects), formulas=tuple(formulas))


def _owner(robot: Robot, free: FreeParameter) -> str:
    return FORMULA_NAME if free.setting == OF_FORMULAS else robot.effects[free.setting].name


def _equations(
    assembly: Assembly, position: SX, velocity: SX, unstrained: SX, speeds: SX, external: SX, own: list[SX]
) -> _Equations:
    force: Sequence[SX] = _three(external)
    shown = []
    cable_rates = []
    effect_rates: list[SX] = []
    symbols = iter(own)
    for index, component in enumerate(assembly.cables):
        states = tuple(tuple(next(symbols) for _ in a.effect.states) for a in component.effects)
        state = cable_law.CableState(unstrained[index], 0.0, states)
        inputs = cable_law.CableInputs(_three(position), _three(velocity), speeds[index])
        arguments = (CASADI, component.constants, component.effects, state)
        line = cable_law.span(CASADI, component.constants, inputs, component.effects)
        moving = cable_law.motion(*arguments, line, inputs.winch_speed)
        reading = cable_law.reading(*arguments, moving)
        rate = cable_law.state_rates(*arguments, moving)
        force = add(force, reading.force)
        shown.append(reading)
        cable_rates.append(rate.unstrained_length)
        effect_rates += [r for rates in rate.effects for r in rates]
    on_platform = tuple(tuple(next(symbols) for _ in a.effect.states) for a in assembly.platform_effects)
    # Of the effects, formulas alone have states on the platform: the time since the start.
    effect_rates += [SX(1.0) for states in on_platform for _ in states]
    acceleration = platform_law.acceleration(
        CASADI, assembly.platform, assembly.platform_effects, on_platform, _three(position), _three(velocity), force
    )
    measured = scale(stages.gains(CASADI, assembly.platform_effects)[1], _three(position))
    return _Equations(
        rates=casadi.vertcat(velocity, *acceleration, *cable_rates, *effect_rates),
        outputs=casadi.vertcat(*measured, velocity, *(r.tension for r in shown), *(r.length for r in shown)),
        span_tensions=casadi.vertcat(*(r.span_tension for r in shown)),
    )


def _lags(assembly: Assembly) -> SX:
    """By how many seconds the measured x, y, z and tensions are late."""
    of_position = stages.delays(CASADI, assembly.platform_effects)[1]
    of_tensions = [stages.delays(CASADI, component.effects)[0] for component in assembly.cables]
    return casadi.vertcat(*[SX(of_position)] * 3, *map(SX, of_tensions))


def _three(column: SX) -> tuple[SX, SX, SX]:
    return (column[0], column[1], column[2])


def _vector(name: str) -> tuple[str, ...]:
    return tuple(f"{name}.{axis}" for axis in AXES)


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{index}" for index in range(1, count + 1))
