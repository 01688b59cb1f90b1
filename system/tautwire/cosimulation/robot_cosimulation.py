"""Co-simulation of a robot's FMUs: cables, winches and platform, driven by winch speeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..array_validation import validate_array, validate_increasing
from ..errors import TautwireError
from ..fmus.fmu_slots import SlotError, missing_user_fmu_ports, require_step_support
from ..fmus.packaging import RobotFmus
from ..process_signals import defer_interrupts
from ..robot.schema import AXES
from . import (
    AdaptiveStep,
    CallJournal,
    Component,
    ComponentError,
    Connection,
    CouplingGraph,
    CouplingSolver,
    Experiment,
    FixedStep,
    InputSource,
    InputSourceError,
    JournalledComponent,
    MemoryRecorder,
    PiecewiseLinearInput,
    Port,
    Progress,
    Recorder,
    RunAbortedError,
    RunStatistics,
    StepSizeControl,
    build_coupling_graph,
    simulate,
    simulate_isolated,
)
from .robot_wiring import (
    CABLE_QUANTITIES,
    ORIENTATION_AXES,
    PLATFORM,
    POINT_COLUMNS,
    TURNING_COLUMNS,
    RobotWiring,
    result_columns,
    wire_robot,
    with_connections,
)
from .run_arguments import validate_fmus, validate_options

Array = NDArray[np.float64]

DEFAULT_STEP = 0.01
START_TOLERANCE = 1e-6  # m
EQUAL_STEP_RTOL = 1e-6

WINCH_SPEED_MEANING = "finite speeds in m/s, a row for each time and a column for each of the {count} cables"
TIME_MEANING = "rising, finite times (N,) in s, two or more"


@dataclass(frozen=True)
class CosimulationResult:
    """Result of a co-simulation of a robot with n cables at N times; SI units.

    ``statistics`` has steps, iterations and the energy residual of the coupling. ``time`` (N,); ``position`` and
    ``velocity`` (N, 3), of the origin of the platform's frame; ``tension``, ``length``, ``elongation`` and ``strain``
    (N, n). ``elongation`` is the paper's r, see :func:`tautwire_fmu.laws.cable.reading`. ``winch_speed`` (N,) is the
    speed of the winch of a cable, counted from 1, where it has one. Columns of a result file that no FMU provides are
    ``missing_columns``, their numbers not finite. ``orientation`` (N, 4), the unit quaternion w, x, y, z from the
    platform's frame to the world, and ``angular_velocity`` (N, 3), in rad/s and the axes of the world, are None for a
    point mass.
    """

    time: Array
    position: Array
    velocity: Array
    tension: Array
    length: Array
    elongation: Array
    strain: Array
    statistics: RunStatistics = field(default_factory=RunStatistics, compare=False)
    winch_speed: Mapping[int, Array] = field(default_factory=dict)
    missing_columns: tuple[str, ...] = ()
    orientation: Array | None = None
    angular_velocity: Array | None = None

    def measured(self) -> Array:
        """Measured outputs, shape (N, 3 + n): x, y, z, then the tensions."""
        return np.hstack([self.position, self.tension])

    def frame(self) -> pd.DataFrame:
        """The run as a table with the columns of a result file."""
        turning = [each for each in (self.orientation, self.angular_velocity) if each is not None]
        cables = [getattr(self, name) for name in CABLE_QUANTITIES]
        rows = np.column_stack([self.time, self.position, self.velocity, *turning, *cables, *self.winch_speed.values()])
        columns = result_columns(self.tension.shape[1], tuple(self.winch_speed), is_rigid=bool(turning))
        return pd.DataFrame(rows, columns=[column.name for column in columns]).drop(columns=list(self.missing_columns))


class RunError(TautwireError):
    """An FMU failed in a run, or what computes its inputs did, hung or crashed; ``result`` is the run until then."""

    def __init__(self, cause: ComponentError | InputSourceError | RunAbortedError, result: CosimulationResult) -> None:
        self.cause = cause
        self.result = result
        super().__init__(str(cause))


@dataclass(frozen=True)
class AdditionalComponents:
    """Additional components: FMUs by name, such as a controller, and ``connections`` from and to them.

    ``external_inputs`` are further external inputs; their values follow those of the winches.
    """

    fmu_paths: Mapping[str, Path] = field(default_factory=dict)
    connections: tuple[Connection, ...] = ()
    external_inputs: tuple[Port, ...] = ()


NO_ADDITIONAL_COMPONENTS = AdditionalComponents()


@contextmanager
def instantiate_robot(
    fmus: RobotFmus,
    journal: CallJournal | None = None,
    additional: AdditionalComponents = NO_ADDITIONAL_COMPONENTS,
    start: float = 0.0,
) -> Iterator[CouplingGraph]:
    """The coupling graph of a robot in initialization mode; instances and folders are removed when the block ends.

    With a ``journal`` each FMU call is noted in it; ``additional`` components are coupled to the robot's; ``start``
    is the time in s at which the run begins.
    """
    wiring = with_connections(wire_fmus(fmus), len(fmus.cables), additional.connections, additional.external_inputs)
    new_component = Component if journal is None else partial(JournalledComponent, journal)
    with ExitStack() as stack:
        components = {
            name: stack.enter_context(new_component(name, path))
            for name, path in {**fmus.by_component, **additional.fmu_paths}.items()
        }
        for name, component in components.items():
            values = fmus.start_values_of(name)
            parameters = {key: value for key, value in values.items() if _is_parameter(component, key)}
            component.initialize(start, parameters, fmus.relative_tolerance)
        _require_platform_start(fmus, components[PLATFORM])
        yield build_coupling_graph(components, wiring)


def _is_parameter(component: Component, name: str) -> bool:
    return name in component.variables and component.variables[name].causality == "parameter"


def _require_platform_start(fmus: RobotFmus, platform: Component) -> None:
    """Refuse a user's platform whose start position or orientation differs from that of the cables."""
    expected_values = fmus.user_start_values.get(PLATFORM, {})
    for quantity, parameter, parts, unit in (
        ("position", "start", AXES, " m"),
        ("orientation", "start_orientation", ORIENTATION_AXES, ""),
    ):
        names = [f"{quantity}.{part}" for part in parts]
        if f"{parameter}.{parts[0]}" not in expected_values or names[0] not in platform.variables:
            continue
        block = platform.block(names)
        platform.read(block)
        expected = np.array([expected_values[f"{parameter}.{part}"] for part in parts])
        # Both signs of a quaternion are one orientation.
        starts = (expected, -expected) if quantity == "orientation" else (expected,)
        if not any(np.max(np.abs(block.values - start)) < START_TOLERANCE for start in starts):
            found_text, expected_text = (
                ", ".join(f"{each:.9g}" for each in values) for values in (block.values, expected)
            )
            problem = f"it starts at {found_text}{unit}, the run at {expected_text}{unit}"
            parameters = f"{', '.join(f'{parameter}.{part}' for part in parts[:-1])} and {parameter}.{parts[-1]}"
            hint = f"start it there, or give it parameters {parameters}, which are then set"
            raise SlotError(fmus.platform, PLATFORM, None, problem, hint)


def wire_fmus(fmus: RobotFmus) -> RobotWiring:
    """How a robot's FMUs are wired; raises SlotError where one of the user's cannot be read."""
    count, is_rigid = len(fmus.cables), fmus.is_rigid
    user_fmus = {slot: fmus.by_component[slot] for slot in fmus.user_start_values}
    missing_ports = missing_user_fmu_ports(user_fmus, count, is_rigid)
    return wire_robot(count, fmus.winch_numbers, missing_ports, fmus.has_position_sensor, is_rigid)


def cosimulate(
    fmus: RobotFmus,
    time: ArrayLike,
    winch_speed: ArrayLike,
    step: float = DEFAULT_STEP,
    tolerance: float | None = None,
    progress: Progress | None = None,
    patience: float | None = None,
) -> CosimulationResult:
    """Co-simulate a robot over sampled winch speeds, linear between samples.

    ``time`` (N,) in s, rising, and ``winch_speed`` (N, n) in m/s, positive reels in, are arrays or columns of a frame.
    Speeds are those of the rope, or the commands of the winches where the robot has such. Macro steps are no longer
    than ``step`` (s), or adaptive where a ``tolerance`` (m) is given, a bound on the sum of their local errors in all
    lengths. ``progress`` gets the completed fraction. With a ``patience`` (s) an FMU fails that takes so long in
    one call, or ends its process. Returns the run at ``time``: arrays (N, 3) and (N, n) in SI units.

    Raises RunError where an FMU fails, StepSizeError where no step meets the tolerance, SlotError where an FMU of the
    user's starts elsewhere or cannot make such steps, ArgumentError where an argument is none of these.
    """
    validate_fmus("cosimulate: fmus", fmus)
    sample_times = validate_increasing("cosimulate: time", time, TIME_MEANING)
    count = len(fmus.cables)
    speeds = validate_array(
        "cosimulate: winch_speed", winch_speed, (len(sample_times), count), WINCH_SPEED_MEANING.format(count=count)
    )
    validate_options("cosimulate", step, tolerance, progress, patience)
    step_size_control = step_size_control_for(step, tolerance, sample_times)
    experiment = Experiment(PiecewiseLinearInput(sample_times, speeds), sample_times, step_size_control)
    return run_cosimulation(fmus, experiment, progress, patience)


def step_size_control_for(step: float, tolerance: float | None, time: Array) -> StepSizeControl:
    """Steps no longer than ``step`` (s); or adaptive where a global error ``tolerance`` (m) is given."""
    return FixedStep(step) if tolerance is None else AdaptiveStep(tolerance, float(time[-1] - time[0]))


def run_cosimulation(
    fmus: RobotFmus,
    experiment: Experiment,
    progress: Progress | None = None,
    call_timeout: float | None = None,
    additional: AdditionalComponents = NO_ADDITIONAL_COMPONENTS,
) -> CosimulationResult:
    """Co-simulate a robot in an experiment whose external inputs are winch speeds.

    ``call_timeout`` and ``additional`` are as for :func:`record_cosimulation`.

    Raises RunError, which has the run until then, where an FMU or the source fails, or the source hangs or
    crashes.
    """
    wiring, time = wire_fmus(fmus), experiment.times
    recorder = MemoryRecorder(len(time), len(wiring.outputs))
    try:
        statistics = record_cosimulation(fmus, experiment, recorder, progress, call_timeout, additional)
    except (ComponentError, InputSourceError, RunAbortedError) as error:
        raise RunError(error, result_from_rows(time[: recorder.count], recorder.rows, fmus, wiring)) from error
    return replace(result_from_rows(time, recorder.rows, fmus, wiring), statistics=statistics)


def record_cosimulation(
    fmus: RobotFmus,
    experiment: Experiment,
    recorder: Recorder,
    progress: Progress | None = None,
    call_timeout: float | None = None,
    additional: AdditionalComponents = NO_ADDITIONAL_COMPONENTS,
) -> RunStatistics:
    """Co-simulate a robot as :func:`run_cosimulation` does; the recorder gets a row at each time.

    A row is in the order of :attr:`RobotWiring.outputs`. Nothing else is kept of a run, however long. With a
    ``call_timeout`` (s) the FMUs run in a worker process, so that one that hangs for so long, or crashes its process,
    is an FMU that fails; see :func:`tautwire.cosimulation.simulate_isolated`. ``additional`` components run with them.

    Raises ComponentError where an FMU fails; the recorder has what came before. Raises SlotError where an FMU of the
    user's starts elsewhere, or cannot make such steps.
    """
    _require_step_support(fmus, experiment)
    wiring = with_connections(wire_fmus(fmus), len(fmus.cables), additional.connections, additional.external_inputs)
    source = SelectedInputs(experiment.input_source, wiring.external_indices)
    experiment = replace(experiment, input_source=source, output_units=wiring.output_units)
    build_system = partial(instantiate_robot, fmus, additional=additional, start=float(experiment.times[0]))
    if call_timeout is not None:
        return simulate_isolated(build_system, experiment, wiring.outputs, recorder, progress, call_timeout)
    with defer_interrupts() as raise_interrupt, build_system() as graph:

        def report_progress(done: float) -> None:
            raise_interrupt()
            if progress is not None:
                progress(done)

        coupling = CouplingSolver(graph, experiment.step_size_control.solver_options)
        simulate(coupling, experiment, wiring.outputs, recorder, report_progress)
        return coupling.statistics


def _require_step_support(fmus: RobotFmus, experiment: Experiment) -> None:
    """Raises SlotError where an FMU of the user's cannot make the steps of an experiment."""
    is_adaptive, intervals = isinstance(experiment.step_size_control, AdaptiveStep), np.diff(experiment.times)
    equal_steps = not is_adaptive and bool(np.ptp(intervals) <= EQUAL_STEP_RTOL * np.max(intervals))
    require_step_support({slot: fmus.by_component[slot] for slot in fmus.user_start_values}, is_adaptive, equal_steps)


@dataclass(frozen=True)
class SelectedInputs:
    """A source of which only the values at ``indices`` are external inputs."""

    source: InputSource
    indices: tuple[int, ...]

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        start, end = self.source.interval(index, time, step, outputs)
        if len(start) == len(self.indices):
            return start, end
        indices = list(self.indices)
        return start[indices], end[indices]


def result_from_rows(time: Array, rows: Array, fmus: RobotFmus, wiring: RobotWiring) -> CosimulationResult:
    """Sort recorded columns, in the order of :attr:`RobotWiring.outputs`, into a result."""
    count, winches = len(fmus.cables), fmus.winch_numbers
    all_columns = np.full((len(rows), len(wiring.output_indices) + len(wiring.missing_columns)), np.nan)
    all_columns[:, wiring.output_indices] = rows
    first_cable = len(POINT_COLUMNS) + (len(TURNING_COLUMNS) if fmus.is_rigid else 0)
    first_winch = first_cable + len(CABLE_QUANTITIES) * count
    cables = all_columns[:, first_cable:first_winch]
    tension, length, elongation, strain = np.split(cables, len(CABLE_QUANTITIES), axis=1)
    return CosimulationResult(
        time,
        all_columns[:, :3],
        all_columns[:, 3:6],
        tension,
        length,
        elongation,
        strain,
        winch_speed=dict(zip(winches, all_columns[:, first_winch:].T, strict=True)),
        missing_columns=wiring.missing_columns,
        orientation=all_columns[:, 6:10] if fmus.is_rigid else None,
        angular_velocity=all_columns[:, 10:13] if fmus.is_rigid else None,
    )
