"""Sensitivities of the innovations to an effect: how it would begin to act, or to change, along a filter's run.

With the effect's states ``z`` and their sensitivities ``Z`` to its parameters

    dz/dt = g(x, z)        dZ/dt = g_z Z + g_p        d(dx/dt) = f_p + f_z Z        d(outputs) = h_p + h_z Z

are taken along the run's states ``x``, see :mod:`tautwire.estimation.filter_linearisation`: an absent effect moves
nothing, so it need not be simulated with them, and one that the robot file declares is in the run already.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi
import numpy as np
from casadi import SX, Function, Sparsity
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import Effect

from ..robot.schema import PER_CABLE_COMPONENTS, EffectSetting, Robot
from ..robot.symbolic_model import FreeParameter, SymbolicModel, symbolic_model, with_statics_as_parameters
from ..robot.uncertain_parameters import uncertain_parameters
from .filter_linearisation import LinearisedSegment
from .hypotheses import PLATFORM_SENSOR_FORMS, Hypothesis
from .measurement_model import SensorInstant, delayed_outputs
from .native_functions import CompiledFunction, by_sample

Array = NDArray[np.float64]


# Integration steps of an effect's states in a sample; they can be stiffer than the robot.
EFFECT_SUBSTEPS = 4


@dataclass(frozen=True)
class SensitivityColumn:
    """A column of the sensitivities: an effect's parameter on a cable (none on the platform), at one grid point."""

    effect: str
    cables: tuple[int, ...]
    parameter: str
    trial: int


class EffectSensitivities:
    """Sensitivities to one effect on each group of cables, as a robot has it there or neutral, beside its others.

    ``columns`` (p) name the parameters; ``values`` (p) where they begin; ``start_sensitivities`` (n, p) are those of
    the start.
    """

    def __init__(
        self,
        robot: Robot,
        effect: Effect,
        cable_groups: Sequence[tuple[int, ...]],
        forms: Sequence[tuple[str, ...]],
        trials: Sequence[Mapping[str, float]],
        state_names: Sequence[str],
    ) -> None:
        if effect.component not in PER_CABLE_COMPONENTS:
            cable_groups = [()]
        free, extended_robot, fixed, nominal = [], robot, [], []
        for group in cable_groups:
            setting = _present_setting(robot, effect, group)
            extended_robot = extended_robot.with_effect(setting)
            index = next(i for i, s in enumerate(extended_robot.effects) if (s.name, s.cables) == (effect.name, group))
            # What all cables share of a sensor effect is the platform's: the first one stands for it.
            moving = (form for form in forms if group == cable_groups[0] or form not in PLATFORM_SENSOR_FORMS)
            names = list(dict.fromkeys(name for form in moving for name in form if name not in trials[0]))
            free += [FreeParameter(index, name) for name in names]
            nominal += [(group, name, float(setting.values[name])) for name in names]
            fixed += [FreeParameter(index, name) for name in trials[0]]
        self._grid_points = trials
        self._moving_indices = [
            _moving_parameters(nominal, forms, trial, number) for number, trial in enumerate(trials)
        ]
        self.columns = tuple(
            SensitivityColumn(effect.name, nominal[i][0], nominal[i][1], number)
            for number, moving in enumerate(self._moving_indices)
            for i in moving
        )
        self.values = np.array([nominal[i][2] for moving in self._moving_indices for i in moving])
        self._nominal_values = np.array([value for _, _, value in nominal])
        self._shape_values = [np.tile(list(trial.values()), len(cable_groups)) for trial in trials]
        self._compile(extended_robot, free, fixed, state_names, robot.cable_count)
        self.restart()
        self.start_sensitivities = np.hstack(
            [self._initial_states(number)[1][:, moving] for number, moving in enumerate(self._moving_indices)]
        )

    def _compile(
        self,
        extended_robot: Robot,
        free: Sequence[FreeParameter],
        fixed: Sequence[FreeParameter],
        state_names: Sequence[str],
        cable_count: int,
    ) -> None:
        uncertain, reference = uncertain_parameters(extended_robot), extended_robot.platform.start_orientation
        complete = symbolic_model(extended_robot, [*free, *fixed], uncertain, reference)
        static_start, model = _StaticStart.of(complete, len(uncertain), len(free)), with_statics_as_parameters(complete)
        shared_indices = [model.state_names.index(name) for name in state_names]
        effect_indices = [index for index in range(len(model.state_names)) if index not in shared_indices]
        z, p = model.states[effect_indices], model.parameters[: len(free)]
        theta = casadi.vertcat(model.parameters, SX(static_start.slopes.nz[:]))
        instant = SensorInstant.of(model)
        state_sensitivities = SX.sym("slopes", _sensitivity_pattern(complete.rates[effect_indices], z, p))
        outputs = delayed_outputs(model, cable_count, instant)
        arguments = [model.states[shared_indices], z, state_sensitivities, model.inputs, theta]

        def total_derivative(expression: SX) -> SX:
            through_states = casadi.mtimes(casadi.jacobian(expression, z), state_sensitivities)
            through_start = casadi.mtimes(
                casadi.jacobian(expression, complete.static_start.symbols), static_start.slopes
            )
            return casadi.jacobian(expression, p) + through_states + through_start

        self._effect_state_count, self._parameter_count = len(effect_indices), len(free)
        forcings = [total_derivative(model.rates[shared_indices]), total_derivative(outputs)]
        self._forcing_function = CompiledFunction(Function("moved", [*arguments, *instant.symbols], forcings))
        effect_rates = model.rates[effect_indices]
        rates = Function("rates", arguments, [casadi.densify(effect_rates), total_derivative(effect_rates)])
        self._step_function = CompiledFunction(_effect_state_step(rates, cable_count), carried=2)
        self._start_function = _start_function(complete, shared_indices, effect_indices, p)
        self._static_start_function = CompiledFunction(static_start.function)
        self._constants = slice(len(shared_indices) - len(uncertain), len(shared_indices))
        self._input_count = model.inputs.numel()

    def restart(self) -> None:
        """Go back to the start, for another run."""
        self._effect_states_now = [self._initial_states(number)[0] for number in range(len(self._grid_points))]

    def _initial_states(self, trial: int) -> tuple[tuple[Array, Array], Array]:
        effect_states, start = self._start_function(self._parameter_values(trial))
        return (np.array(effect_states), np.zeros((self._effect_state_count, self._parameter_count))), np.array(start)

    def _parameter_values(self, trial: int) -> Array:
        theta: Array = np.append(self._nominal_values, self._shape_values[trial])
        return theta

    def of_rates_and_outputs(self, run: LinearisedSegment) -> tuple[Array, Array]:
        """Sensitivities of the rates (K + 1, n, p) and outputs (K, m, p) along the next segment of the run."""
        inputs = np.pad(run.speeds, ((0, self._input_count - len(run.speeds)), (0, 0)))
        columns = (run.speeds[:, 1:], run.step[None, :], run.shift, run.rotation)
        instant = [_with_last_column_repeated(column) for column in columns]
        per_trial = [
            self._derivatives_at_grid_point(run, inputs, instant, number) for number in range(len(self._grid_points))
        ]
        rate_sensitivities, output_sensitivities = (
            np.concatenate(parts, axis=2) for parts in zip(*per_trial, strict=True)
        )
        return rate_sensitivities, output_sensitivities[:-1]

    def _derivatives_at_grid_point(
        self, run: LinearisedSegment, inputs: Array, instant: Sequence[Array], trial: int
    ) -> tuple[Array, Array]:
        """Sensitivities of rates (K + 1, n, p) and outputs (K + 1, m, p) along the predicted states.

        The noise of what they predict has not touched those.
        """
        values, count = self._parameter_values(trial)[:, None], run.states.shape[1]
        (static_start,) = self._static_start_function(count, values, run.states[self._constants])
        theta = np.vstack([np.tile(values, count), static_start])
        effect_states, sensitivities = self._propagate_effect_states(run, theta, trial)
        derivatives = self._forcing_function(count, run.states, effect_states, sensitivities, inputs, theta, *instant)
        by_rates, by_outputs = (by_sample(part, count)[:, :, self._moving_indices[trial]] for part in derivatives)
        return by_rates, by_outputs

    def _propagate_effect_states(self, run: LinearisedSegment, theta: Array, trial: int) -> tuple[Array, Array]:
        """The effect's states (z, K + 1) and their sensitivities (z, p x (K + 1)).

        In a step theta is what it is predicted to be at the end: it is updated at samples, before a step begins.
        """
        count, parameter_count = len(run.step), self._parameter_count
        if not self._effect_state_count:
            return np.zeros((0, count + 1)), np.zeros((0, parameter_count * (count + 1)))
        interval_ends = (run.states[:, :-1], run.states[:, 1:], run.speeds[:, :-1], run.speeds[:, 1:])
        effect_states, sensitivities = self._step_function(
            count, *self._effect_states_now[trial], *interval_ends, run.step[None, :], theta[:, 1:]
        )
        self._effect_states_now[trial] = (effect_states[:, -1:], sensitivities[:, parameter_count * count :])
        return effect_states, sensitivities


@dataclass(frozen=True)
class _StaticStart:
    """Static start: symbols of its derivatives ``slopes`` (s, p) by free parameters, and a ``function`` for all of it.

    Of the parameters and the uncertain constants that gives the values (s,), then what of their derivatives is not
    always zero, in one column.
    """

    slopes: SX
    function: Function

    @classmethod
    def of(cls, model: SymbolicModel, constant_count: int, free_count: int) -> _StaticStart:
        """Of a model whose last states are uncertain constants."""
        constants = model.states[model.states.numel() - constant_count :]
        by_parameters = model.static_start.jacobian(model.parameters[:free_count])
        column = casadi.vertcat(model.static_start.values, SX(by_parameters.nz[:]))
        function = Function("static_start", [model.parameters, constants], [casadi.densify(column)])
        return cls(SX.sym("slopes_of_start", by_parameters.sparsity()), function)


def _start_function(
    model: SymbolicModel, shared_indices: Sequence[int], effect_indices: Sequence[int], parameters: SX
) -> Function:
    """The effect's states at the start, and the sensitivities of the others there to some parameters."""
    sensitivities = casadi.jacobian(model.start[list(shared_indices)], parameters)
    starts = [casadi.densify(each) for each in (model.start[list(effect_indices)], sensitivities)]
    return Function("start", [model.parameters], starts)


def _present_setting(robot: Robot, effect: Effect, cables: tuple[int, ...]) -> EffectSetting:
    """The effect as a robot has it on some cables; neutral where it has none, or none on all of these."""
    present = (s for s in robot.effects if s.name == effect.name and set(cables) <= set(s.cables))
    setting = next(present, None)
    return replace(setting, cables=cables) if setting else Hypothesis(effect, cables).neutral(robot, cables)


def _with_last_column_repeated(columns: Array) -> Array:
    """The columns, with the last one twice."""
    return np.hstack([columns, columns[:, -1:]])


def _moving_parameters(
    nominal: Sequence[tuple[tuple[int, ...], str, float]],
    forms: Sequence[tuple[str, ...]],
    trial: Mapping[str, float],
    trial_index: int,
) -> list[int]:
    """Indices of the parameters that differ from one grid point to the next; at the first all."""
    moving = {name for form in forms if set(form) & set(trial) for name in form}
    return [i for i, (_, name, _) in enumerate(nominal) if trial_index == 0 or name in moving]


def _sensitivity_pattern(rates: SX, states: SX, parameters: SX) -> Sparsity:
    """Where sensitivities of states that begin at zero can ever differ from it.

    Those of one cable's states to another cable's parameters never do, nor those to what no rate contains.
    """
    by_state = casadi.DM(casadi.jacobian_sparsity(rates, states), 1.0)
    pattern = casadi.jacobian_sparsity(rates, parameters)
    while True:
        reached = pattern + casadi.mtimes(by_state, casadi.DM(pattern, 1.0)).sparsity()
        if reached == pattern:
            return pattern
        pattern = reached


def _effect_state_step(rates: Function, cable_count: int) -> Function:
    """One sample's step of the effect's states and their sensitivities, straight between two states of the run."""
    state_pattern, *effect_patterns, input_pattern, theta_pattern = map(rates.sparsity_in, range(rates.n_in()))
    input_count = input_pattern.size1()
    z, sensitivities = (SX.sym(name, pattern) for name, pattern in zip(("z", "slopes"), effect_patterns, strict=True))
    begin, end, theta = SX.sym("begin", state_pattern), SX.sym("end", state_pattern), SX.sym("theta", theta_pattern)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")

    def rates_at(fraction: float, effect_states: SX, effect_sensitivities: SX) -> list[SX]:
        state = begin + fraction * (end - begin)
        inputs = casadi.vertcat(speed + fraction * (later - speed), SX(input_count - cable_count, 1))
        return list(rates(state, effect_states, effect_sensitivities, inputs, theta))

    next_states, next_sensitivities = z, sensitivities
    substep = step / EFFECT_SUBSTEPS
    for k in range(EFFECT_SUBSTEPS):
        begin_fraction, middle_fraction, end_fraction = (
            k / EFFECT_SUBSTEPS,
            (k + 0.5) / EFFECT_SUBSTEPS,
            (k + 1.0) / EFFECT_SUBSTEPS,
        )
        a = rates_at(begin_fraction, next_states, next_sensitivities)
        b = rates_at(middle_fraction, next_states + 0.5 * substep * a[0], next_sensitivities + 0.5 * substep * a[1])
        c = rates_at(middle_fraction, next_states + 0.5 * substep * b[0], next_sensitivities + 0.5 * substep * b[1])
        d = rates_at(end_fraction, next_states + substep * c[0], next_sensitivities + substep * c[1])
        next_states = next_states + substep / 6.0 * (a[0] + 2.0 * (b[0] + c[0]) + d[0])
        next_sensitivities = next_sensitivities + substep / 6.0 * (a[1] + 2.0 * (b[1] + c[1]) + d[1])
    return Function(
        "own_step", [z, sensitivities, begin, end, speed, later, step, theta], [next_states, next_sensitivities]
    )
