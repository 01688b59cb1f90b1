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
from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import point_mass as platform_law
from tautwire_fmu.laws.effects import State
from tautwire_fmu.laws.formula import ELAPSED_TIME
from tautwire_fmu.laws.formula import FORMULA_EFFECT_NAME as FORMULA_NAME
from tautwire_fmu.laws.mathematics import Mathematics
from tautwire_fmu.laws.vectors import add, scale

from .robot_assembly import RobotAssembly, assemble_robot
from .schema import EffectSetting, Robot
from .symbolic_statics import symbolic_start_tensions
from .uncertain_parameters import AXES, UncertainParameter, perturbed_robot, sensor_offsets

Array = NDArray[np.float64]

# Instead of an effect's index: a parameter of the formulas.
FORMULA_INDEX = -1

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
class FreeParameter:
    """A free parameter: a number of an effect that stays a symbol; ``effect_index`` counts the robot's effects from 0.

    It is FORMULA_INDEX for a number of the formulas.
    """

    effect_index: int
    name: str


@dataclass(frozen=True)
class SymbolicModel:
    """The equations of a robot as a state-space model of SX columns.

    States: position, velocity, unstrained lengths, and those states of effects that something depends on. Inputs:
    winch speeds, external force. Outputs: measured position and tensions without sensor delay, velocity, lengths.
    ``sensor_delays`` (3 + n) of positions and tensions in s; ``span_tensions`` (n) of the free spans in N. ``start``
    is the state in static equilibrium; ``drifting`` are the indices of states without equilibrium; ``parameters``
    are the free ones.
    """

    states: SX
    inputs: SX
    parameters: SX
    rates: SX
    outputs: SX
    span_tensions: SX
    sensor_delays: SX
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
    """A state of an effect with its symbol; ``cable`` counts from 1, 0 for the platform."""

    effect: str
    cable: int
    state: State
    symbol: SX

    @property
    def name(self) -> str:
        return f"{self.effect}.{self.state.name}_{self.cable}" if self.cable else f"{self.effect}.{self.state.name}"


def symbolic_model(
    robot: Robot, free_parameters: Sequence[FreeParameter] = (), uncertain_parameters: Sequence[UncertainParameter] = ()
) -> SymbolicModel:
    """Assembles the equations of a robot with some parameters of its effects as symbols.

    Each of ``uncertain_parameters`` is one more state, after all others: in standard deviations, zero at the start.
    The static start follows the free parameters; with more than three cables, cables at a tension limit stay there.
    Not valid across a change of which cables are at a limit.
    """
    symbols = [SX.sym(f"{_owner_name(robot, f)}.{f.name}") for f in free_parameters]
    perturbations = [SX.sym(number.label) for number in uncertain_parameters]
    symbolic_robot = _with_symbols(
        perturbed_robot(robot, uncertain_parameters, perturbations), free_parameters, symbols
    )
    assembly = assemble_robot(
        symbolic_robot, symbolic_start_tensions(robot, symbolic_robot, CASADI_MATHEMATICS), CASADI_MATHEMATICS
    )
    count = len(assembly.cables)
    position, velocity = SX.sym("position", 3), SX.sym("velocity", 3)
    unstrained = SX.sym("unstrained_length", count)
    winch_speeds, external_force = SX.sym("winch_speed", count), SX.sym("external_force", 3)
    effect_states = _effect_states(assembly)
    equations = _equations(
        assembly, position, velocity, unstrained, winch_speeds, external_force, [e.symbol for e in effect_states]
    )
    mechanical_states = casadi.vertcat(position, velocity, unstrained)
    unique_indices = [place for place, state in enumerate(effect_states) if state not in effect_states[:place]]
    effect_states = [effect_states[place] for place in unique_indices]
    rows = [*range(mechanical_states.numel()), *(mechanical_states.numel() + place for place in unique_indices)]
    equations = replace(equations, rates=equations.rates[rows])
    relevant_indices = _relevant_effect_states(
        casadi.vertcat(mechanical_states, *(e.symbol for e in effect_states)), mechanical_states.numel(), equations
    )
    lengths = [SX(c.constants.start_length) for c in assembly.cables]
    initial_state = casadi.vertcat(
        SX(list(assembly.start)), SX(list(assembly.velocity)), *lengths, SX(len(relevant_indices), 1)
    )
    sensor_offset = casadi.vertcat(*map(SX, sensor_offsets(uncertain_parameters, perturbations, count)))
    return SymbolicModel(
        states=casadi.vertcat(
            mechanical_states, *(effect_states[place].symbol for place in relevant_indices), *perturbations
        ),
        inputs=casadi.vertcat(winch_speeds, external_force),
        parameters=casadi.vertcat(*symbols) if symbols else SX(0, 1),
        rates=casadi.vertcat(
            equations.rates[
                [*range(mechanical_states.numel()), *(mechanical_states.numel() + place for place in relevant_indices)]
            ],
            SX(len(perturbations), 1),
        ),
        outputs=equations.outputs + casadi.vertcat(sensor_offset[:3], SX(3, 1), sensor_offset[3:], SX(count, 1)),
        span_tensions=equations.span_tensions,
        sensor_delays=_sensor_delays(assembly),
        start=casadi.vertcat(_nominal_start(initial_state, perturbations), SX(len(perturbations), 1)),
        drifting=tuple(
            mechanical_states.numel() + i
            for i, place in enumerate(relevant_indices)
            if effect_states[place].state.drifts
        ),
        state_names=(
            *_axis_names("position"),
            *_axis_names("velocity"),
            *_numbered_names("unstrained_length", count),
            *(effect_states[place].name for place in relevant_indices),
            *(f"uncertain {number.label}" for number in uncertain_parameters),
        ),
        input_names=(*_numbered_names("winch_speed", count), *_axis_names("external_force")),
        output_names=(
            *_axis_names("position"),
            *_axis_names("velocity"),
            *_numbered_names("tension", count),
            *_numbered_names("length", count),
        ),
    )


def _nominal_start(start: SX, perturbations: Sequence[SX]) -> SX:
    """The initial state at the declared values, independent of the uncertain parameters."""
    return (
        casadi.substitute(start, casadi.vertcat(*perturbations), SX.zeros(len(perturbations), 1))
        if perturbations
        else start
    )


def freeze_drifting_states(model: SymbolicModel) -> SymbolicModel:
    """The model with states that have no equilibrium frozen at their initial values and removed."""
    if not model.drifting:
        return model
    settling_indices = [place for place in range(model.states.numel()) if place not in model.drifting]
    frozen_states = model.states[list(model.drifting)]
    expressions = [model.rates[settling_indices], model.outputs, model.span_tensions]
    rates, outputs, tensions = casadi.substitute(expressions, [frozen_states], [SX.zeros(*frozen_states.shape)])
    return replace(
        model,
        states=model.states[settling_indices],
        rates=rates,
        outputs=outputs,
        span_tensions=tensions,
        start=model.start[settling_indices],
        drifting=(),
        state_names=tuple(model.state_names[place] for place in settling_indices),
    )


def _effect_states(assembly: RobotAssembly) -> list[_EffectState]:
    """States of effects of the cables, then of the platform; all formulas share one time state."""
    components = [
        *enumerate((component.effects for component in assembly.cables), start=1),
        (0, assembly.platform_effects),
    ]
    effect_states = [
        _EffectState(active.effect.name, index, state, SX.sym(state.name))
        for index, effects in components
        for active in effects
        for state in active.effect.states
    ]
    time = _EffectState(FORMULA_NAME, 0, ELAPSED_TIME, SX.sym(ELAPSED_TIME.name))
    return [time if (each.effect, each.state) == (FORMULA_NAME, ELAPSED_TIME) else each for each in effect_states]


def _relevant_effect_states(states: SX, mechanical_count: int, equations: _Equations) -> list[int]:
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


def _with_symbols(robot: Robot, free_parameters: Sequence[FreeParameter], symbols: Sequence[SX]) -> Robot:
    effects = list(robot.effects)
    numbers: dict[str, Any] = {
        p.name: symbol for p, symbol in zip(free_parameters, symbols, strict=True) if p.effect_index == FORMULA_INDEX
    }
    formulas = [
        replace(f, numbers={name: numbers.get(name, value) for name, value in f.numbers.items()})
        for f in robot.formulas
    ]
    for parameter, symbol in zip(free_parameters, symbols, strict=True):
        if parameter.effect_index == FORMULA_INDEX:
            continue
        setting = effects[parameter.effect_index]
        values: dict[str, Any] = {**setting.values, parameter.name: symbol}
        effects[parameter.effect_index] = EffectSetting(setting.name, values, setting.cables)
    return replace(robot, effects=tuple(effects), formulas=tuple(formulas))


def _owner_name(robot: Robot, parameter: FreeParameter) -> str:
    return FORMULA_NAME if parameter.effect_index == FORMULA_INDEX else robot.effects[parameter.effect_index].name


def _equations(
    assembly: RobotAssembly,
    position: SX,
    velocity: SX,
    unstrained: SX,
    winch_speeds: SX,
    external_force: SX,
    effect_states: list[SX],
) -> _Equations:
    force: Sequence[SX] = _components(external_force)
    readings = []
    cable_rates = []
    effect_rates: list[SX] = []
    symbols = iter(effect_states)
    for index, component in enumerate(assembly.cables):
        states = tuple(tuple(next(symbols) for _ in a.effect.states) for a in component.effects)
        state = cable_law.CableState(unstrained[index], 0.0, states)
        inputs = cable_law.CableInputs(_components(position), _components(velocity), winch_speeds[index])
        arguments = (CASADI_MATHEMATICS, component.constants, component.effects, state)
        span = cable_law.span(CASADI_MATHEMATICS, component.constants, inputs, component.effects)
        motion = cable_law.cable_motion(*arguments, span, inputs.winch_speed)
        reading = cable_law.cable_outputs(*arguments, motion)
        rate = cable_law.state_rates(*arguments, motion)
        force = add(force, reading.force)
        readings.append(reading)
        cable_rates.append(rate.unstrained_length)
        effect_rates += [r for rates in rate.effects for r in rates]
    platform_states = tuple(tuple(next(symbols) for _ in a.effect.states) for a in assembly.platform_effects)
    # On the platform only formulas have states: the time since the start.
    effect_rates += [SX(1.0) for states in platform_states for _ in states]
    acceleration = platform_law.acceleration(
        CASADI_MATHEMATICS,
        assembly.platform,
        assembly.platform_effects,
        platform_states,
        _components(position),
        _components(velocity),
        force,
    )
    measured = scale(stages.sensor_gains(CASADI_MATHEMATICS, assembly.platform_effects)[1], _components(position))
    return _Equations(
        rates=casadi.vertcat(velocity, *acceleration, *cable_rates, *effect_rates),
        outputs=casadi.vertcat(*measured, velocity, *(r.tension for r in readings), *(r.length for r in readings)),
        span_tensions=casadi.vertcat(*(r.span_tension for r in readings)),
    )


def _sensor_delays(assembly: RobotAssembly) -> SX:
    """Delays of the measured x, y, z and tensions, in s."""
    position_delay = stages.sensor_delays(CASADI_MATHEMATICS, assembly.platform_effects)[1]
    tension_delays = [stages.sensor_delays(CASADI_MATHEMATICS, component.effects)[0] for component in assembly.cables]
    return casadi.vertcat(*[SX(position_delay)] * 3, *map(SX, tension_delays))


def _components(column: SX) -> tuple[SX, SX, SX]:
    return (column[0], column[1], column[2])


def _axis_names(name: str) -> tuple[str, ...]:
    return tuple(f"{name}.{axis}" for axis in AXES)


def _numbered_names(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{index}" for index in range(1, count + 1))
