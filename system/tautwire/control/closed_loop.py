"""Closed-loop co-simulation: the FMUs under a controller that runs in the master, or is an FMU itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from control import StateSpace
from numpy.typing import ArrayLike, NDArray

from ..array_validation import validate_array, validate_increasing
from ..cosimulation import Connection, Experiment, FixedStep, InputSource, Port, Progress
from ..cosimulation.isolation import RunAbortedError
from ..cosimulation.robot_cosimulation import (
    DEFAULT_STEP,
    NO_ADDITIONAL_COMPONENTS,
    TIME_MEANING,
    AdditionalComponents,
    CosimulationResult,
    RunError,
    run_cosimulation,
    wire_fmus,
)
from ..cosimulation.robot_wiring import (
    ORIENTATION_AXES,
    RobotWiring,
    measured_output_indices,
    result_columns,
    winch_input_ports,
)
from ..cosimulation.run_arguments import validate_fmus, validate_options
from ..errors import ArgumentError, InputError
from ..fmus.packaging import RobotFmus, package_controller_fmu
from ..robot.schema import AXES, Robot, validate_robot
from ..robot.trajectory import DURATION_RULE as OF_PATH
from ..robot.trajectory import Trajectory, require_trajectory
from ..validation import (
    validate_attributes,
    validate_file,
    validate_folder,
    validate_instance,
    validate_integer,
    validate_number,
)
from .controller_fmu import ControllerFmu, ControllerFmuError
from .design import ControlAim, Design
from .external_controller import SpeedController, SpeedLaw, designed, path_source
from .feedforward import Reference, elastic_reference
from .input_sources import AllColumnsSource, JoinedSources, ZeroInput, external_loads
from .path_controller import controller_data

Array = NDArray[np.float64]

CONTROLLER_NAME = "controller"
RUN_DURATION_RULE = OF_PATH._replace(meaning="the duration of the run")
DESIGN_ATTRIBUTES = ("aim", "cable_count", "uses_feedback", "knots")


def sample_times(period: float, duration: float) -> Array:
    """Sample times with ``period`` (s) until ``duration`` (s) is reached."""
    count = int(np.ceil(duration / period * (1.0 - 1e-9))) + 1
    return np.linspace(0.0, (count - 1) * period, count)


@dataclass(frozen=True)
class RunOptions:
    """Options of a run with a controller: ``step`` bounds the macro step in s.

    ``external_force`` (N, 3) in N acts on the platform, held from sample to sample, and so does ``external_moment``
    (N, 3) in N m on one that turns; ``progress`` and ``patience`` are as for :func:`tautwire.cosimulate`.
    """

    step: float = DEFAULT_STEP
    external_force: ArrayLike | None = None
    progress: Progress | None = None
    patience: float | None = None
    external_moment: ArrayLike | None = None


@dataclass(frozen=True)
class ClosedLoopOptions(RunOptions):
    """Options of a run whose controller is in the master: ``seed`` enables the noise of the robot's sensors.

    ``reference`` is at the controller's samples, by default that of the elastic model. ``aim`` has the sample period
    and the limits of a controller that is no design; ``discretisation`` of a continuous one is ``tustin`` or ``zoh``.
    """

    seed: int | None = None
    reference: Reference | None = None
    aim: ControlAim | None = None
    discretisation: str = "tustin"


def cosimulate_closed_loop(
    fmus: RobotFmus,
    robot: Robot,
    controller: Design | StateSpace | SpeedLaw | str | Path,
    trajectory: Trajectory,
    duration: float,
    options: ClosedLoopOptions | None = None,
) -> CosimulationResult:
    """Co-simulates the FMUs in closed loop over N whole samples until ``duration`` (s) is reached.

    ``controller`` is a design, a python-control StateSpace (:func:`state_space_controller`), a function
    ``(time, measured) -> speeds`` (:func:`function_controller`) or a controller FMU (:func:`fmu_controller`).
    ``robot`` is the controller's model. Returns the run at the controller's samples. With winches the controller's
    speeds are their commands.

    Raises RunError, which has the run until then, where an FMU or a controller fails or hangs (of a function that
    fails, its ``cause`` is a ControllerError), UnreachableError where the path requires a cable to push, StretchError
    where no speeds follow it, ControllerFmuError where a controller FMU does not fit, InputError where an FMU lacks a
    measured output or robot, controller and FMUs do not match, SlotError where a load is on a user's platform without
    an input for it, ArgumentError for an invalid argument.
    """
    caller, options = "cosimulate_closed_loop", options or ClosedLoopOptions()
    validate_fmus(f"{caller}: fmus", fmus)
    validate_robot(f"{caller}: robot", robot)
    controller = designed(f"{caller}: controller", controller, robot, options.aim, options.discretisation)
    _require_design(caller, robot, controller, trajectory)
    validate_number(f"{caller}: duration", duration, RUN_DURATION_RULE)
    if options.seed is not None:
        validate_integer(f"{caller}: seed", options.seed, 0, "give a whole number, or None for no noise")
    _require_cables(fmus, robot, controller)
    wiring = wire_fmus(fmus)
    _require_measured(wiring, robot.name, len(fmus.cables), fmus.is_rigid)
    validate_options(caller, options.step, None, options.progress, options.patience)
    times = sample_times(controller.aim.period, duration)
    if options.reference is not None:
        _require_reference(caller, options.reference, len(times), robot)
    loads, ports = external_loads(caller, fmus, len(times), options.external_force, options.external_moment)
    with path_source(robot, controller, trajectory, times, options.seed, options.reference) as path_controller:
        source = AllColumnsSource(
            path_controller, wiring.output_indices, len(wiring.outputs) + len(wiring.missing_columns)
        )
        extra = AdditionalComponents(external_inputs=ports) if loads else NO_ADDITIONAL_COMPONENTS
        try:
            return _run(fmus, JoinedSources((source, *loads)) if loads else source, times, options, extra)
        except RunError as error:
            raise _with_controller_named(error, controller) from error.cause


def build_controller_fmu(
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    folder: str | Path,
    reference: Reference | None = None,
) -> Path:
    """Writes ``controller.fmu`` into ``folder``: the controller with its path until ``duration`` (s), where it rests.

    ``reference`` is at the controller's samples, by default that of the elastic model. Its inputs are the measured
    pose and tensions, its outputs winch speeds and their rates.

    Raises UnreachableError where the path requires a cable to push, ArgumentError for an invalid argument.
    """
    data, target_folder = _controller_resource(
        "build_controller_fmu", robot, controller, trajectory, duration, folder, reference
    )
    return package_controller_fmu(data, target_folder)


def build_native_controller_fmu(
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    folder: str | Path,
    reference: Reference | None = None,
) -> Path:
    """As :func:`build_controller_fmu`, as machine code for this machine, with its source, that needs no Python.

    Raises NativeBuildError where it cannot be compiled, else what :func:`build_controller_fmu` raises.
    """
    data, target_folder = _controller_resource(
        "build_native_controller_fmu", robot, controller, trajectory, duration, folder, reference
    )
    return package_controller_fmu(data, target_folder, native=True)


def _controller_resource(
    caller: str,
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    folder: str | Path,
    reference: Reference | None,
) -> tuple[dict[str, Any], Path]:
    """Resource of a controller FMU, and the folder that it goes to."""
    _require_design(caller, robot, controller, trajectory)
    if isinstance(controller, SpeedController):
        problem = "is a function or an FMU, which no controller FMU contains"
        hint = "give a design or what state_space_controller returns; an FMU runs by cosimulate_with_controller"
        raise ArgumentError(f"{caller}: controller", controller, problem, hint)
    validate_number(f"{caller}: duration", duration, RUN_DURATION_RULE)
    target_folder = validate_folder(f"{caller}: folder", folder)
    times = sample_times(controller.aim.period, duration)
    if reference is not None:
        _require_reference(caller, reference, len(times), robot)
    data = controller_data(robot, controller, reference or elastic_reference(robot, trajectory, times))
    return data, target_folder


def cosimulate_with_controller(
    fmus: RobotFmus, controller: str | Path, time: ArrayLike, options: RunOptions | None = None
) -> CosimulationResult:
    """Co-simulates a robot's FMUs with a controller FMU, such as :func:`build_controller_fmu` writes.

    ``time`` (N,) in s, rising, from 0; macro steps end at each of these times, which should contain the controller's
    samples.

    Raises RunError where an FMU fails, SlotError where a load is on a user's platform without an input for it,
    ArgumentError for an invalid argument.
    """
    caller, options = "cosimulate_with_controller", options or RunOptions()
    validate_fmus(f"{caller}: fmus", fmus)
    components = {CONTROLLER_NAME: validate_file(f"{caller}: controller", controller)}
    instants = validate_increasing(f"{caller}: time", time, TIME_MEANING)
    validate_options(caller, options.step, None, options.progress, options.patience)
    loads, ports = external_loads(caller, fmus, len(instants), options.external_force, options.external_moment)
    zero_input = ZeroInput(len(winch_input_ports(len(fmus.cables))))
    extra = AdditionalComponents(components, controller_wires(fmus), ports)
    return _run(fmus, JoinedSources((zero_input, *loads)), instants, options, extra)


def controller_wires(fmus: RobotFmus) -> tuple[Connection, ...]:
    """Connections from the measured outputs to the controller, and from it to the winch inputs."""
    count, wiring = len(fmus.cables), wire_fmus(fmus)
    orientation = [f"orientation.{part}" for part in ORIENTATION_AXES] if fmus.is_rigid else []
    tensions = [f"tension_{i}" for i in range(1, count + 1)]
    input_names = [*(f"position.{axis}" for axis in AXES), *orientation, *tensions]
    _require_measured(wiring, "controller_wires: fmus", count, fmus.is_rigid)
    port_of = dict(zip(wiring.output_indices, wiring.outputs, strict=True))
    measured_ports = [port_of[index] for index in measured_output_indices(count, fmus.is_rigid)]
    output_names = [f"{name}_{i}" for i in range(1, count + 1) for name in ("winch_speed", "winch_acceleration")]
    target_ports = winch_input_ports(count, fmus.winch_numbers)
    return (
        *(
            Connection(port, Port(CONTROLLER_NAME, name))
            for port, name in zip(measured_ports, input_names, strict=True)
        ),
        *(
            Connection(Port(CONTROLLER_NAME, output_names[index]), target_ports[index])
            for index in wiring.external_indices
        ),
    )


def _run(
    fmus: RobotFmus, source: InputSource, times: Array, options: RunOptions, extra: AdditionalComponents
) -> CosimulationResult:
    experiment = Experiment(source, times, FixedStep(options.step))
    return run_cosimulation(fmus, experiment, options.progress, options.patience, extra)


def _with_controller_named(error: RunError, controller: Design) -> RunError:
    """The error of a run, which names a controller that hung or ended the process."""
    cause = error.cause
    if not (isinstance(cause, RunAbortedError) and isinstance(controller, SpeedController)):
        return error
    where, hint = f"in the controller {controller.origin}", "call it alone"
    return RunError(RunAbortedError(cause.status, cause.time, where, hint), error.result)


def _require_design(caller: str, robot: Robot, controller: Design, trajectory: Trajectory) -> None:
    validate_robot(f"{caller}: robot", robot)
    validate_attributes(
        f"{caller}: controller", controller, DESIGN_ATTRIBUTES, "controller", "give what design_controller returns"
    )
    require_trajectory(f"{caller}: trajectory", trajectory)


def _require_reference(caller: str, reference: Reference, count: int, robot: Robot) -> None:
    where, cables = f"{caller}: reference", robot.cable_count
    pose_size = 7 if robot.platform.is_rigid_body else 3
    validate_instance(where, reference, Reference, "give what elastic_reference returns")
    meaning = f"that of the controller's {count} samples, sample_times(period, duration)"
    for part, width in {"speeds": cables, "rigid": cables, "expected": pose_size + cables}.items():
        validate_array(f"{where}.{part}", getattr(reference, part), (count, width), meaning)


def _require_cables(fmus: RobotFmus, robot: Robot, controller: Design) -> None:
    counts = {len(fmus.cables), robot.cable_count, controller.cable_count}
    if len(counts) > 1:
        problem = (
            f"has {robot.cable_count} cables, the controller {controller.cable_count}, the FMUs {len(fmus.cables)}"
        )
        raise InputError(robot.name, problem, "give those of one robot")
    if fmus.is_rigid != robot.platform.is_rigid_body:
        turning = "that turns" if fmus.is_rigid else "that is a point mass"
        raise InputError(robot.name, f"has another platform than the FMUs, {turning}", "give those of one robot")
    speeds_from = controller.speeds_from if isinstance(controller, SpeedController) else None
    if isinstance(speeds_from, ControllerFmu) and speeds_from.is_rigid != fmus.is_rigid:
        hint = f"match it by fmu_controller(path, {robot.cable_count}, is_rigid={fmus.is_rigid})"
        raise ControllerFmuError(speeds_from.path, None, "it is matched for another platform", hint)


def _require_measured(wiring: RobotWiring, where: str, cable_count: int, is_rigid: bool) -> None:
    """Raises InputError where no FMU has an output that a controller measures."""
    columns = result_columns(cable_count, is_rigid=is_rigid)[1:]
    measured = (columns[index].name for index in measured_output_indices(cable_count, is_rigid))
    missing = [name for name in measured if name in wiring.missing_columns]
    if missing:
        problem = f"the controller needs {', '.join(missing)}, which no FMU outputs"
        raise InputError(where, problem, "add the output to an FMU")
