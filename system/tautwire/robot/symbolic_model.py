"""The whole robot as one CasADi expression, made from the laws: for exact derivatives and compiled fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi
from casadi import SX

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.formula import FORMULA_EFFECT_NAME as FORMULA_NAME
from tautwire_fmu.laws.rotation import Quaternion

from .active_effects import platform_axes
from .measured_start import with_true_start
from .platform_symbols import StateIndices, platform_symbols
from .rigid_equilibrium import leaves_orientation_to_equilibrium
from .robot_assembly import RobotAssembly, assemble_robot
from .schema import EffectSetting, Robot
from .static_equilibrium import start_orientation
from .static_start import StaticStart, at_roots
from .symbolic_equations import CASADI_MATHEMATICS, Equations, MechanicalVariables, minimal_equations
from .symbolic_statics import SymbolicStatics, held_statics, symbolic_statics
from .uncertain_parameters import SensorErrors, UncertainParameter, limited_perturbation, perturbed_robot, sensor_errors

# Instead of an effect's index: a parameter of the formulas.
FORMULA_INDEX = -1


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
    ``rates_by_statics`` and ``outputs_by_statics`` have those numbers of the static start that depend on parameters or
    uncertain states as symbols of their own, see ``static_start``.
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
    outputs_by_statics: SX
    static_start: StaticStart


def symbolic_model(
    robot: Robot,
    free_parameters: Sequence[FreeParameter] = (),
    uncertain_parameters: Sequence[UncertainParameter] = (),
    reference_orientation: Quaternion | None = None,
) -> SymbolicModel:
    """Assembles the equations of a robot with some parameters of its effects as symbols.

    Each of ``uncertain_parameters`` is one more state, after all others: in standard deviations, zero at the start.
    The static start follows the free parameters; with more cables than degrees of freedom, cables at a tension limit
    stay there. It follows uncertain parameters too, but not where an orientation follows from equilibrium: that bends
    too much with them, and is a state that a filter does not know at first. Not valid across a change of which cables
    are at a limit. Rotations of a rigid body count from the ``reference_orientation``, by default that of the start.
    """
    symbols = [SX.sym(f"{_owner_name(robot, f)}.{f.name}") for f in free_parameters]
    constants = [SX.sym(number.label) for number in uncertain_parameters]
    perturbations = [limited_perturbation(constant, casadi.sqrt) for constant in constants]
    perturbed = perturbed_robot(robot, uncertain_parameters, perturbations)
    symbolic_robot, declared = (
        with_true_start(_with_symbols(each, free_parameters, symbols), CASADI_MATHEMATICS)
        for each in (perturbed, robot)
    )
    nominal = with_true_start(robot)
    at_start = declared if leaves_orientation_to_equilibrium(robot) else symbolic_robot
    reference = start_orientation(nominal) if reference_orientation is None else reference_orientation
    statics = symbolic_statics(nominal, at_start, reference, CASADI_MATHEMATICS)
    assembly = _assembly(symbolic_robot, at_start, statics)
    count = len(assembly.cables)
    axes = platform_axes(robot.platform) if robot.platform.is_rigid_body else None
    platform = platform_symbols(CASADI_MATHEMATICS, symbolic_robot, assembly.platform, reference, axes)
    shifts = _length_shifts(assembly, constants)
    held = held_statics(assembly.cables, shifts, [*symbols, *constants], statics.roots)
    lengths, winch_speeds = SX.sym("unstrained_length", count), SX.sym("winch_speed", count)
    variables = MechanicalVariables(platform, lengths, winch_speeds, held.length_shifts)
    effect_states, equations = minimal_equations(replace(assembly, cables=held.cables), variables)
    by_statics, equations = equations, _with_static_values(equations, held.start)
    start = _at_declared(_initial_state(assembly, statics.rotation, len(effect_states)), constants)
    (start,) = at_roots([start], statics.roots)
    no_rates, indices = SX(len(constants), 1), StateIndices(platform.pose.numel(), count)
    first_effect_state = variables.states.numel()
    errors = sensor_errors(uncertain_parameters, perturbations, count)
    return SymbolicModel(
        states=casadi.vertcat(variables.states, *(each.symbol for each in effect_states), *constants),
        inputs=variables.inputs,
        parameters=casadi.vertcat(*symbols) if symbols else SX(0, 1),
        rates=casadi.vertcat(equations.rates, no_rates),
        outputs=_shown(equations.outputs, indices, errors),
        span_tensions=equations.span_tensions,
        sensor_delays=_sensor_delays(assembly, platform.pose.numel() - 3),
        start=casadi.vertcat(start, no_rates),
        drifting=tuple(first_effect_state + i for i, each in enumerate(effect_states) if each.state.drifts),
        state_names=(
            *variables.state_names,
            *(each.name for each in effect_states),
            *(f"uncertain {number.label}" for number in uncertain_parameters),
        ),
        input_names=variables.input_names,
        output_names=variables.output_names,
        indices=indices,
        reference_orientation=reference,
        rates_by_statics=casadi.vertcat(by_statics.rates, no_rates),
        outputs_by_statics=_shown(by_statics.outputs, indices, errors),
        static_start=held.start,
    )


def _assembly(robot: Robot, at_start: Robot, statics: SymbolicStatics) -> RobotAssembly:
    """The assembly of a robot whose cables have their start from another one."""
    assembly, started = (
        assemble_robot(each, statics.tensions, CASADI_MATHEMATICS, statics.orientation) for each in (robot, at_start)
    )
    cables = [
        replace(
            component,
            constants=component.constants._replace(
                start_length=start.start_length,
                start_tension=start.start_tension,
                start_direction=start.start_direction,
                start_cell_tension=start.start_cell_tension,
            ),
        )
        for component, start in zip(assembly.cables, (each.constants for each in started.cables), strict=True)
    ]
    return replace(assembly, cables=tuple(cables))


def _at_declared(expression: SX, constants: Sequence[SX]) -> SX:
    """An expression at the declared values of uncertain parameters."""
    column = casadi.vertcat(SX(0, 1), *constants)
    return casadi.substitute([expression], [column], [SX.zeros(column.shape)])[0]


def _with_static_values(equations: Equations, start: StaticStart) -> Equations:
    """The equations as functions of states, inputs and parameters alone."""
    if not start.symbols.numel():
        return equations
    expressions = [equations.rates, equations.outputs, equations.span_tensions]
    return Equations(*casadi.substitute(expressions, [start.symbols], [start.values]))


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
    return lengths - _at_declared(lengths, constants)


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


def with_statics_as_parameters(model: SymbolicModel) -> SymbolicModel:
    """The model with its static start as further parameters, for what is evaluated many times while that stays."""
    return replace(
        model,
        rates=model.rates_by_statics,
        outputs=model.outputs_by_statics,
        parameters=casadi.vertcat(model.parameters, model.static_start.symbols),
    )


def freeze_drifting_states(model: SymbolicModel) -> SymbolicModel:
    """The model with states that have no equilibrium frozen at their initial values and removed."""
    if not model.drifting:
        return model
    settling_indices = [index for index in range(model.states.numel()) if index not in model.drifting]
    frozen_states = model.states[list(model.drifting)]
    expressions = [model.rates[settling_indices], model.outputs, model.span_tensions]
    expressions += [model.rates_by_statics[settling_indices], model.outputs_by_statics]
    rates, outputs, tensions, *by_statics = casadi.substitute(
        expressions, [frozen_states], [SX.zeros(*frozen_states.shape)]
    )
    return replace(
        model,
        states=model.states[settling_indices],
        rates=rates,
        rates_by_statics=by_statics[0],
        outputs_by_statics=by_statics[1],
        outputs=outputs,
        span_tensions=tensions,
        start=model.start[settling_indices],
        drifting=(),
        state_names=tuple(model.state_names[index] for index in settling_indices),
    )


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


def _sensor_delays(assembly: RobotAssembly, rotation_count: int) -> SX:
    """Delays of the measured x, y, z, tensions and rotations, in s: a tracker that lags does so with its whole pose."""
    position_delay = stages.sensor_delays(CASADI_MATHEMATICS, assembly.platform_effects)[1]
    tension_delays = [stages.sensor_delays(CASADI_MATHEMATICS, component.effects)[0] for component in assembly.cables]
    return casadi.vertcat(*[SX(position_delay)] * 3, *map(SX, tension_delays), *[SX(position_delay)] * rotation_count)
