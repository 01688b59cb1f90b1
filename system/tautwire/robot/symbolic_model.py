"""The whole robot as one CasADi expression, made from the laws: for exact derivatives and compiled fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

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
from tautwire_fmu.laws.rotation import Quaternion
from tautwire_fmu.laws.vectors import add, scale

from .active_effects import platform_axes
from .measured_start import with_true_start
from .platform_symbols import PlatformSymbols, StateIndices, platform_symbols, vector_of
from .robot_assembly import RobotAssembly, assemble_robot
from .schema import EffectSetting, Robot
from .static_equilibrium import start_orientation
from .symbolic_statics import HeldStatics, held_statics, symbolic_statics
from .uncertain_parameters import SensorErrors, UncertainParameter, limited_perturbation, perturbed_robot, sensor_errors

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

    States: pose and twist of the platform, unstrained lengths, and those states of effects that something depends on.
    Inputs: winch speeds, external wrench. Outputs: measured pose, twist, measured tensions, lengths, without sensor
    delay. The pose of a point mass is its position; :class:`tautwire.robot.platform_symbols.RigidBodySymbols`.
    ``sensor_delays`` (m) of positions, tensions and rotations in s; ``span_tensions`` (n) of the free spans in N.
    ``start`` is the state in static equilibrium; ``drifting`` are the indices of states without equilibrium;
    ``parameters`` are the free ones. ``reference_orientation`` is the one from which rotations of a rigid body count.
    ``rates_by_statics`` are the rates with those numbers of the static start that depend on parameters or uncertain
    states as symbols of their own, ``static_symbols``; ``static_values`` are these, the same all through a sample.
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
    indices: StateIndices
    reference_orientation: Quaternion
    rates_by_statics: SX
    static_symbols: SX
    static_values: SX


@dataclass(frozen=True)
class _Variables:
    """The mechanical states, and the inputs, as symbols.

    ``length_shifts`` (n) are what unstrained lengths are longer than their states: a state starts at the length that
    the declared anchors give, whatever the uncertain ones are.
    """

    platform: PlatformSymbols
    unstrained_lengths: SX
    winch_speeds: SX
    length_shifts: SX = field(default_factory=SX)

    @property
    def states(self) -> SX:
        return casadi.vertcat(self.platform.pose, self.platform.twist, self.unstrained_lengths)

    @property
    def inputs(self) -> SX:
        return casadi.vertcat(self.winch_speeds, self.platform.external_wrench)


@dataclass(frozen=True)
class _Equations:
    """Rates of the mechanical states and of those of effects, outputs, and tensions of the free spans."""

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
    robot: Robot,
    free_parameters: Sequence[FreeParameter] = (),
    uncertain_parameters: Sequence[UncertainParameter] = (),
    reference_orientation: Quaternion | None = None,
) -> SymbolicModel:
    """Assembles the equations of a robot with some parameters of its effects as symbols.

    Each of ``uncertain_parameters`` is one more state, after all others: in standard deviations, zero at the start.
    The static start follows the free parameters; with more cables than degrees of freedom, cables at a tension limit
    stay there. Not valid across a change of which cables are at a limit. Rotations of a rigid body count from the
    ``reference_orientation``, by default that of the start.
    """
    symbols = [SX.sym(f"{_owner_name(robot, f)}.{f.name}") for f in free_parameters]
    constants = [SX.sym(number.label) for number in uncertain_parameters]
    perturbations = [limited_perturbation(constant, casadi.sqrt) for constant in constants]
    symbolic_robot = _with_symbols(
        perturbed_robot(robot, uncertain_parameters, perturbations), free_parameters, symbols
    )
    symbolic_robot = with_true_start(symbolic_robot, CASADI_MATHEMATICS)
    nominal = with_true_start(robot)
    reference = start_orientation(nominal) if reference_orientation is None else reference_orientation
    statics = symbolic_statics(nominal, symbolic_robot, reference, CASADI_MATHEMATICS)
    assembly = assemble_robot(symbolic_robot, statics.tensions, CASADI_MATHEMATICS, statics.orientation)
    count = len(assembly.cables)
    axes = platform_axes(robot.platform) if robot.platform.is_rigid_body else None
    platform = platform_symbols(CASADI_MATHEMATICS, symbolic_robot, assembly.platform, reference, axes)
    variables = _Variables(
        platform,
        unstrained_lengths=SX.sym("unstrained_length", count),
        winch_speeds=SX.sym("winch_speed", count),
    )
    held = held_statics(assembly.cables, _length_shifts(assembly, constants), [*symbols, *constants])
    variables = replace(variables, length_shifts=held.length_shifts)
    effect_states, equations = _minimal_equations(replace(assembly, cables=held.cables), variables)
    rates_by_statics, equations = equations.rates, _with_static_values(equations, held)
    no_rates, indices = SX(len(constants), 1), StateIndices(platform.pose.numel(), count)
    first_effect_state = variables.states.numel()
    return SymbolicModel(
        states=casadi.vertcat(variables.states, *(each.symbol for each in effect_states), *constants),
        inputs=variables.inputs,
        parameters=casadi.vertcat(*symbols) if symbols else SX(0, 1),
        rates=casadi.vertcat(equations.rates, no_rates),
        outputs=_shown(equations.outputs, indices, sensor_errors(uncertain_parameters, perturbations, count)),
        span_tensions=equations.span_tensions,
        sensor_delays=_sensor_delays(assembly, platform.pose.numel() - 3),
        start=casadi.vertcat(
            _nominal_start(_initial_state(assembly, statics.rotation, len(effect_states)), constants), no_rates
        ),
        drifting=tuple(first_effect_state + i for i, each in enumerate(effect_states) if each.state.drifts),
        state_names=(
            *platform.pose_names,
            *platform.twist_names,
            *_numbered_names("unstrained_length", count),
            *(each.name for each in effect_states),
            *(f"uncertain {number.label}" for number in uncertain_parameters),
        ),
        input_names=(*_numbered_names("winch_speed", count), *platform.wrench_names),
        output_names=(
            *platform.pose_names,
            *platform.twist_names,
            *_numbered_names("tension", count),
            *_numbered_names("length", count),
        ),
        indices=indices,
        reference_orientation=reference,
        rates_by_statics=casadi.vertcat(rates_by_statics, no_rates),
        static_symbols=held.symbols,
        static_values=held.values,
    )


def _with_static_values(equations: _Equations, held: HeldStatics) -> _Equations:
    """The equations as functions of states, inputs and parameters alone."""
    if not held.symbols.numel():
        return equations
    expressions = [equations.rates, equations.outputs, equations.span_tensions]
    return _Equations(*casadi.substitute(expressions, [held.symbols], [held.values]))


def _shown(outputs: SX, indices: StateIndices, errors: SensorErrors) -> SX:
    """The outputs as sensors with constant errors show them; velocities and lengths are not measured."""
    shown = casadi.vertsplit(outputs)
    measured_rows = [*range(3), *range(indices.tensions.start, indices.tensions.stop)]
    for row, gain, offset in zip(measured_rows, errors.gains, errors.offsets, strict=True):
        shown[row] = (shown[row] if isinstance(gain, float) else gain * shown[row]) + offset
    return casadi.vertcat(*shown)


def _initial_state(assembly: RobotAssembly, rotation: SX, effect_state_count: int) -> SX:
    lengths = [SX(component.constants.start_length) for component in assembly.cables]
    start = casadi.vertcat(*map(SX, assembly.start))
    turning = SX(list(assembly.angular_velocity)[: rotation.numel()])
    motion = casadi.vertcat(start, rotation, SX(list(assembly.velocity)), turning)
    return casadi.vertcat(motion, *lengths, SX(effect_state_count, 1))


def _length_shifts(assembly: RobotAssembly, constants: Sequence[SX]) -> SX:
    """How much longer the cables are at the start (n,) than at the declared values of the uncertain parameters."""
    lengths = casadi.vertcat(*(SX(component.constants.start_length) for component in assembly.cables))
    if not constants or not casadi.depends_on(lengths, casadi.vertcat(*constants)):
        return SX(lengths.shape[0], 1)
    return lengths - _nominal_start(lengths, constants)


def _nominal_start(start: SX, constants: Sequence[SX]) -> SX:
    """The initial state at the declared values, independent of the uncertain parameters."""
    return casadi.substitute(start, casadi.vertcat(*constants), SX.zeros(len(constants), 1)) if constants else start


def constants_as_parameters(model: SymbolicModel, count: int) -> SymbolicModel:
    """The model with its last ``count`` states, which are constant, as parameters behind its own."""
    first = model.states.numel() - count
    return replace(
        model,
        states=model.states[:first],
        parameters=casadi.vertcat(model.parameters, model.states[first:]),
        rates=model.rates[:first],
        rates_by_statics=model.rates_by_statics[:first],
        start=model.start[:first],
        state_names=model.state_names[:first],
    )


def freeze_drifting_states(model: SymbolicModel) -> SymbolicModel:
    """The model with states that have no equilibrium frozen at their initial values and removed."""
    if not model.drifting:
        return model
    settling_indices = [index for index in range(model.states.numel()) if index not in model.drifting]
    frozen_states = model.states[list(model.drifting)]
    expressions = [model.rates[settling_indices], model.outputs, model.span_tensions]
    expressions.append(model.rates_by_statics[settling_indices])
    rates, outputs, tensions, by_statics = casadi.substitute(
        expressions, [frozen_states], [SX.zeros(*frozen_states.shape)]
    )
    return replace(
        model,
        states=model.states[settling_indices],
        rates=rates,
        rates_by_statics=by_statics,
        outputs=outputs,
        span_tensions=tensions,
        start=model.start[settling_indices],
        drifting=(),
        state_names=tuple(model.state_names[index] for index in settling_indices),
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


def _minimal_equations(assembly: RobotAssembly, variables: _Variables) -> tuple[list[_EffectState], _Equations]:
    """The equations with those states of effects alone, each once, that influence an output; and these states."""
    effect_states = _effect_states(assembly)
    equations = _equations(assembly, variables, [each.symbol for each in effect_states])
    mechanical_count = variables.states.numel()

    def select(indices: Sequence[int]) -> tuple[list[_EffectState], _Equations]:
        rows = [*range(mechanical_count), *(mechanical_count + index for index in indices)]
        return [effect_states[index] for index in indices], replace(equations, rates=equations.rates[rows])

    effect_states, equations = select([i for i, each in enumerate(effect_states) if each not in effect_states[:i]])
    states = casadi.vertcat(variables.states, *(each.symbol for each in effect_states))
    return select(_relevant_effect_states(states, mechanical_count, equations))


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


def _equations(assembly: RobotAssembly, variables: _Variables, effect_states: list[SX]) -> _Equations:
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
    return _Equations(
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


def _sensor_delays(assembly: RobotAssembly, rotation_count: int) -> SX:
    """Delays of the measured x, y, z, tensions and rotations, in s: a tracker that lags does so with its whole pose."""
    position_delay = stages.sensor_delays(CASADI_MATHEMATICS, assembly.platform_effects)[1]
    tension_delays = [stages.sensor_delays(CASADI_MATHEMATICS, component.effects)[0] for component in assembly.cables]
    return casadi.vertcat(*[SX(position_delay)] * 3, *map(SX, tension_delays), *[SX(position_delay)] * rotation_count)


def _numbered_names(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{index}" for index in range(1, count + 1))
