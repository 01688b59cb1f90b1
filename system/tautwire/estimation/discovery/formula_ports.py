"""Sensitivity of the filter's run to a formula at each of its sites: a force, a tension in a rope, a mass.

Any term of a formula is one series along the run times the sensitivities of its site. The initial state follows too: a
force present at the start changes the static tensions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws.formula import ELAPSED_TIME, FORCE_TARGETS, FORMULA_EFFECT_NAME

from ...robot.robot_assembly import NUMPY_MATHEMATICS, RobotAssembly, assemble_robot
from ...robot.schema import Formula, Robot
from ...robot.symbolic_model import FORMULA_INDEX, FreeParameter, symbolic_model
from ...robot.uncertain_parameters import uncertain_parameters
from ..filter_linearisation import LinearisedSegment
from ..measurement_model import SensorInstant, delayed_outputs
from ..native_functions import CompiledFunction, by_sample

Array = NDArray[np.float64]

# A unit step just after the start, where neither a tension nor a growing mass acts yet.
STEP_AFTER_START = f"tanh(1e9*{ELAPSED_TIME.name})"
TIME_STATE = f"{FORMULA_EFFECT_NAME}.{ELAPSED_TIME.name}"


class Site(NamedTuple):
    """Site of a formula: its target, and the cables in which it acts together, none on the platform."""

    target: str
    cables: tuple[int, ...] = ()


@dataclass(frozen=True)
class PortSignals:
    """Signals that formulas may use along K + 1 samples of a run: on the platform, and in each rope; (K + 1,) each."""

    platform: dict[str, Array]
    ropes: tuple[dict[str, Array], ...]


class FormulaPorts:
    """Sites of a robot where formulas act: the forces by axis, the mass, the tension of each cable; p = 4 + n of them.

    Segments have to be handed in one after the other, in time order.
    """

    def __init__(self, robot: Robot, state_names: Sequence[str]) -> None:
        self._robot = robot
        self._assembly: RobotAssembly = assemble_robot(robot)
        self._names = tuple(state_names)
        numbers = [f"port_{i}" for i in range(4 + robot.cable_count)]
        texts = [*numbers[:3], *(f"{number}*{STEP_AFTER_START}" for number in numbers[3:])]
        sites = [
            *((force, ()) for force in FORCE_TARGETS),
            ("mass", ()),
            *(("tension", (i,)) for i in robot.cable_numbers),
        ]
        formulas = [
            Formula(target, text, cables, {number: 0.0})
            for (target, cables), text, number in zip(sites, texts, numbers, strict=True)
        ]
        extended_robot = replace(robot, formulas=(*robot.formulas, *formulas))
        self._sensitivities = CompiledFunction(_build_sensitivities(extended_robot, numbers, state_names))
        self._elapsed, self._travel = 0.0, np.zeros(robot.cable_count)

    def signals(self, segment: LinearisedSegment) -> PortSignals:
        """Signals that formulas may use, along the predicted states."""
        states = dict(zip(self._names, segment.states, strict=True))
        steps = np.append(0.0, segment.step)
        time = self._elapsed + np.cumsum(steps)
        increments = 0.5 * (segment.speeds[:, 1:] + segment.speeds[:, :-1]) * segment.step
        travel = self._travel[:, None] + np.hstack([np.zeros((len(increments), 1)), np.cumsum(increments, axis=1)])
        self._elapsed, self._travel = float(time[-1]), travel[:, -1]
        position = [states[f"position.{axis}"] for axis in "xyz"]
        velocity = [states[f"velocity.{axis}"] for axis in "xyz"]
        platform = dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*position, *velocity), strict=True))
        ropes = []
        for index, component in enumerate(self._assembly.cables):
            effect_states = tuple(
                tuple(
                    states.get(self._state_name(a.effect.name, s.name, index), np.zeros_like(time))
                    for s in a.effect.states
                )
                for a in component.effects
            )
            inputs = cable_law.CableInputs(position, velocity, segment.speeds[index])
            line = cable_law.span(NUMPY_MATHEMATICS, component.constants, inputs, component.effects)
            unstrained = states[f"unstrained_length_{index + 1}"]
            state = cable_law.CableState(unstrained, travel[index], effect_states)
            motion = cable_law.cable_motion(
                NUMPY_MATHEMATICS, component.constants, component.effects, state, line, segment.speeds[index]
            )
            values = (motion.strain, motion.strain_rate, motion.elastic_tension, line.length, segment.speeds[index])
            names = ("strain", "strain_rate", "tension", "length", "winch_speed")
            ropes.append(dict(zip(names, values, strict=True)) | {"travel": travel[index], "time": time})
        return PortSignals(platform | {"time": time}, tuple(ropes))

    def _state_name(self, effect: str, state: str, index: int) -> str:
        return (
            TIME_STATE
            if (effect, state) == (FORMULA_EFFECT_NAME, ELAPSED_TIME.name)
            else f"{effect}.{state}_{index + 1}"
        )

    def sensitivities(self, segment: LinearisedSegment, time: Array) -> tuple[Array, Array, Array, Array]:
        """Sensitivities at K + 1 samples to a unit at each site: rates (K + 1, n, p), outputs (K + 1, m, p).

        And the same to a unit at the start, through the static tensions.
        """
        speeds = np.vstack([segment.speeds, np.zeros((3, len(time)))])
        columns = (segment.speeds[:, 1:], segment.step[None, :], segment.shift, segment.rotation)
        step_inputs = [np.hstack([column, column[:, -1:]]) for column in columns]
        results = self._sensitivities(len(time), segment.states, time[None, :], speeds, *step_inputs)
        shaped = [by_sample(part, len(time)) for part in results]
        return shaped[0], shaped[1], shaped[2], shaped[3]


def series_sensitivities(
    sites: Sequence[Site],
    series: Sequence[Array],
    initial_values: Sequence[Array],
    ports: FormulaPorts,
    segment: LinearisedSegment,
    time: Array,
) -> tuple[Array, Array]:
    """Sensitivities B (K, n, p) and D (K, m, p) of a linearised filter segment to series at some sites.

    Each series has a row for each cable of its site, or one on the platform, (rows, K + 1); ``initial_values`` (rows,)
    are those at the start. ``time`` (K + 1,) in s.
    """
    rate_sensitivities, output_sensitivities, initial_rate_sensitivities, initial_output_sensitivities = (
        ports.sensitivities(segment, time)
    )
    site_series = list(zip(sites, series, initial_values, strict=True))
    by_rates = np.stack(
        [_site_sensitivity(*case, rate_sensitivities, initial_rate_sensitivities) for case in site_series], axis=2
    )
    by_outputs = np.stack(
        [_site_sensitivity(*case, output_sensitivities, initial_output_sensitivities) for case in site_series], axis=2
    )
    return segment.integrated_forcing(by_rates), by_outputs[:-1]


@dataclass(frozen=True)
class RunRows:
    """A segment of a run, the sensitivities (K, m, p) of its whitened innovations to p series, and which rows count."""

    segment: LinearisedSegment
    sensitivities: Array
    rows: NDArray[np.bool_]


def sensitivities_along_run(
    segments: Iterable[LinearisedSegment],
    ports: FormulaPorts,
    sites: Sequence[Site],
    series_in: Callable[[PortSignals, int], Sequence[Array]],
    is_counted: NDArray[np.bool_],
) -> Iterator[RunRows]:
    """Sensitivities of a run's innovations to a series at each of p sites, segment by segment.

    ``series_in`` gives the series of a segment, as in :func:`series_sensitivities`, from its signals and the number of
    its first sample; ``is_counted`` (N,) tells which samples of the recording count.
    """
    state_sensitivities: Array | None = None
    initial_values: list[Array] = []
    first_sample, first_recorded = 0, 0
    for segment in segments:
        signals = ports.signals(segment)
        series = series_in(signals, first_sample)
        if state_sensitivities is None:
            state_sensitivities = np.zeros((len(segment.states), len(sites)))
            initial_values = [values[:, 0] for values in series]
        forcing = series_sensitivities(sites, series, initial_values, ports, segment, signals.platform["time"])
        state_sensitivities, innovation_sensitivities = segment.propagate_sensitivities(state_sensitivities, *forcing)
        rows = np.zeros(len(segment.is_recorded), dtype=bool)
        recorded_count = int(np.sum(segment.is_recorded))
        rows[segment.is_recorded] = is_counted[first_recorded : first_recorded + recorded_count]
        yield RunRows(segment, innovation_sensitivities, rows)
        first_sample += len(segment.step)
        first_recorded += recorded_count


def _site_sensitivity(
    site: Site, values: Array, initial_values: Array, slopes: Array, initial_sensitivities: Array
) -> Array:
    """Sensitivity to one series, (K + 1, rates or outputs)."""
    if site.target in FORCE_TARGETS:
        port = FORCE_TARGETS.index(site.target)
        by_force: Array = (
            slopes[:, :, port] * values[0][:, None] + initial_sensitivities[:, :, port] * initial_values[0]
        )
        return by_force
    if site.target == "mass":
        by_mass: Array = slopes[:, :, 3] * values[0][:, None]
        return by_mass
    rows = zip(site.cables, values, initial_values, strict=True)
    by_tension: Array = np.sum(
        [slopes[:, :, 3 + cable] * (row - initial)[:, None] for cable, row, initial in rows], axis=0
    )
    return by_tension


def _build_sensitivities(robot: Robot, numbers: Sequence[str], state_names: Sequence[str]) -> Function:
    """CasADi function of states of the run, time, inputs, next speed, step, shift: the four results at one sample."""
    free = [FreeParameter(FORMULA_INDEX, number) for number in numbers]
    model = symbolic_model(robot, free, uncertain_parameters(robot))
    count = robot.cable_count
    state_indices = [model.state_names.index(name) for name in state_names]
    instant = SensorInstant.of(model)
    outputs = delayed_outputs(model, count, instant)
    time = SX.sym("time")
    omitted_states = [index for index in range(model.states.numel()) if index not in state_indices]
    external_forces = model.inputs[count:]
    results: list[tuple[SX, SX]] = []
    for expression in (model.rates[state_indices], outputs):
        by_number = casadi.jacobian(expression, model.parameters)
        by_force = casadi.jacobian(expression, external_forces)
        slopes = casadi.horzcat(by_force, by_number[:, 3:])
        initial_sensitivities = casadi.horzcat(by_number[:, :3] - by_force, SX(expression.numel(), 1 + count))
        results.append((slopes, initial_sensitivities))
    (rate_sensitivities, initial_rate_sensitivities), (output_sensitivities, initial_output_sensitivities) = results
    arguments = [model.states[state_indices], time, model.inputs, *instant.symbols]
    expressions = [rate_sensitivities, output_sensitivities, initial_rate_sensitivities, initial_output_sensitivities]
    placeholders = [model.parameters, *([model.states[omitted_states]] if omitted_states else [])]
    substitutes = [SX.zeros(len(numbers)), *([time] if omitted_states else [])]
    evaluated = casadi.substitute(expressions, placeholders, substitutes)
    return Function("ports", arguments, [casadi.densify(expression) for expression in evaluated])
