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
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.vectors import add

from .assembly import Assembly, assemble
from .robot import EffectSetting, Robot
from .statics import DEFAULT_LIMITS, directions, platform_effects, static_tensions

Array = NDArray[np.float64]

AXES = ("x", "y", "z")
AT_BOUND = 1e-6

CASADI = Mathematics(
    log=casadi.log,
    exp=casadi.exp,
    sqrt=casadi.sqrt,
    sin=casadi.sin,
    cos=casadi.cos,
    tanh=casadi.tanh,
    absolute=casadi.fabs,
    maximum=casadi.fmax,
    where=lambda condition, a, b: casadi.if_else(condition > 0, a, b),
)


@dataclass(frozen=True)
class FreeParameter:
    """A parameter of an effect of the robot that stays a symbol; ``setting`` counts the robot's effects from 0."""

    setting: int
    name: str


@dataclass(frozen=True)
class Model:
    """The equations of a robot; SX columns.

    States: position, velocity, unstrained lengths, states of every effect. Inputs: winch speeds, external force.
    Outputs: position, velocity, tensions, lengths. ``start`` is the state at the static start; ``parameters`` are
    the free ones.
    """

    states: SX
    inputs: SX
    parameters: SX
    rates: SX
    outputs: SX
    start: SX
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]


def symbolic_model(robot: Robot, free: Sequence[FreeParameter] = ()) -> Model:
    """Assemble the equations of a robot with some parameters of its effects left free.

    The static start follows the free parameters; with more than three cables, cables at a tension limit stay there.
    Not valid across a change of which cables are at a limit.
    """
    symbols = [SX.sym(f"{robot.effects[f.setting].name}.{f.name}") for f in free]
    opened = _with_symbols(robot, free, symbols)
    assembly = assemble(opened, _start_tensions(robot, opened))
    count = len(assembly.cables)
    position, velocity = SX.sym("position", 3), SX.sym("velocity", 3)
    unstrained = SX.sym("unstrained_length", count)
    speeds, external = SX.sym("winch_speed", count), SX.sym("external_force", 3)
    own = [[SX.sym(s.name) for a in c.effects for s in a.effect.states] for c in assembly.cables]
    rates, outputs = _equations(assembly, position, velocity, unstrained, speeds, external, own)
    lengths = [c.constants.start_length for c in assembly.cables]
    effect_states = [state for states in own for state in states]
    return Model(
        states=casadi.vertcat(position, velocity, unstrained, *effect_states),
        inputs=casadi.vertcat(speeds, external),
        parameters=casadi.vertcat(*symbols) if symbols else SX(0, 1),
        rates=rates,
        outputs=outputs,
        start=casadi.vertcat(SX(list(assembly.start)), SX(3, 1), SX(lengths), SX(len(effect_states), 1)),
        state_names=_state_names(assembly),
        input_names=(*_numbered("winch_speed", count), *_vector("external_force")),
        output_names=(
            *_vector("position"),
            *_vector("velocity"),
            *_numbered("tension", count),
            *_numbered("length", count),
        ),
    )


def _with_symbols(robot: Robot, free: Sequence[FreeParameter], symbols: Sequence[SX]) -> Robot:
    effects = list(robot.effects)
    for parameter, symbol in zip(free, symbols, strict=True):
        old = effects[parameter.setting]
        values: dict[str, Any] = {**old.values, parameter.name: symbol}
        effects[parameter.setting] = EffectSetting(old.name, values, old.cables)
    return replace(robot, effects=tuple(effects))


def _start_tensions(nominal: Robot, opened: Robot) -> list[SX]:
    """Static tensions as expressions: cables at a limit stay there, the others share the rest."""
    tensions = static_tensions(nominal)
    unit = directions(nominal)
    constants = platform_law.PointMassConstants(opened.platform.mass, opened.gravity)
    mass = platform_law.total_mass(CASADI, constants, platform_effects(opened))
    load = casadi.vertcat(0.0, 0.0, mass * opened.gravity)
    limits = nominal.tension or DEFAULT_LIMITS
    span = max(float(np.max(tensions)), 1.0) * AT_BOUND
    held = np.zeros(len(tensions), dtype=bool)
    if len(tensions) > 3:
        held = (tensions - limits.minimum < span) | (limits.maximum - tensions < span)
    preferred = np.full(int(np.sum(~held)), limits.preferred)
    rest = load - unit[:, held] @ tensions[held] - unit[:, ~held] @ preferred
    shares = preferred + casadi.DM(np.linalg.pinv(unit[:, ~held])) @ rest
    result: list[SX] = [SX(float(t)) for t in tensions]
    for place, index in enumerate(np.flatnonzero(~held)):
        result[index] = SX(shares[place])
    return result


def _equations(
    assembly: Assembly,
    position: SX,
    velocity: SX,
    unstrained: SX,
    speeds: SX,
    external: SX,
    own: list[list[SX]],
) -> tuple[SX, SX]:
    force: Sequence[SX] = _three(external)
    shown = []
    cable_rates = []
    effect_rates: list[SX] = []
    for index, component in enumerate(assembly.cables):
        symbols = iter(own[index])
        states = tuple(tuple(next(symbols) for _ in a.effect.states) for a in component.effects)
        state = cable_law.CableState(unstrained[index], 0.0, states)
        inputs = cable_law.CableInputs(_three(position), _three(velocity), speeds[index])
        arguments = (CASADI, component.constants, component.effects, state)
        line = cable_law.span(CASADI, component.constants, inputs)
        moving = cable_law.motion(*arguments, line, inputs.winch_speed)
        reading = cable_law.reading(*arguments, moving)
        rate = cable_law.state_rates(*arguments, moving)
        force = add(force, reading.force)
        shown.append(reading)
        cable_rates.append(rate.unstrained_length)
        effect_rates += [r for rates in rate.effects for r in rates]
    none = tuple(() for _ in assembly.platform_effects)
    acceleration = platform_law.acceleration(
        CASADI, assembly.platform, assembly.platform_effects, none, _three(position), _three(velocity), force
    )
    rates = casadi.vertcat(velocity, *acceleration, *cable_rates, *effect_rates)
    outputs = casadi.vertcat(position, velocity, *(r.tension for r in shown), *(r.length for r in shown))
    return rates, outputs


def _three(column: SX) -> tuple[SX, SX, SX]:
    return (column[0], column[1], column[2])


def _vector(name: str) -> tuple[str, ...]:
    return tuple(f"{name}.{axis}" for axis in AXES)


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{index}" for index in range(1, count + 1))


def _state_names(assembly: Assembly) -> tuple[str, ...]:
    effects = tuple(
        f"{active.effect.name}.{state.name}_{index}"
        for index, component in enumerate(assembly.cables, start=1)
        for active in component.effects
        for state in active.effect.states
    )
    return (
        *_vector("position"),
        *_vector("velocity"),
        *_numbered("unstrained_length", len(assembly.cables)),
        *effects,
    )
