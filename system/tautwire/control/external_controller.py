"""Controllers that were designed elsewhere: state spaces, functions and FMUs, sampled and limited like our own.

From the measurements at sample k a controller computes the winch speeds that are reached at sample k + 2: one sample of
computing delay, then a ramp. The first two samples have the reference's speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import Any

import control
import numpy as np
from control import StateSpace
from numpy.typing import ArrayLike, NDArray

from tautwire_fmu.laws import sampled_control as law
from tautwire_fmu.laws.sampled_control import ControllerState

from ..cosimulation import InputSourceError
from ..errors import ArgumentError, describe_value, one_line
from ..name_suggestions import suggest_name
from ..robot.schema import Robot
from ..robot.trajectory import Trajectory
from ..validation import validate_file, validate_instance
from .controller_fmu import ControllerFmu, ControllerFmuError, Sample
from .design import ControlAim, Design, Feedforward, RegulatorDesign, regulator_signals
from .feedforward import Reference
from .path_controller import PathController

Array = NDArray[np.float64]
SpeedLaw = Callable[[float, Array], ArrayLike]

PERIOD_TOLERANCE = 1e-9
DISCRETISATIONS = ("tustin", "zoh")


class ControllerError(InputSourceError):
    """A controller failed at ``time`` (s), from ``measured``, pose and tensions; ``problem`` says how."""

    def __init__(self, time: float, measured: Sequence[float], problem: str) -> None:
        super().__init__(time, measured, problem)
        self.time = time
        self.measured = tuple(measured)
        self.problem = problem

    def __str__(self) -> str:
        values = ", ".join(f"{value:.6g}" for value in self.measured)
        return one_line(f"the controller {self.problem} at {self.time:.6g} s, measured [{values}]")


@dataclass(frozen=True)
class SpeedController(Feedforward):
    """Winch speeds (n,) from a sample by ``speeds_from``, in place of those of a reference."""

    speeds_from: SpeedLaw | ControllerFmu | None = None

    @property
    def origin(self) -> str:
        """What computes the speeds, for messages: the file of an FMU, or the name of a function."""
        if isinstance(self.speeds_from, ControllerFmu):
            return str(self.speeds_from.path)
        return str(getattr(self.speeds_from, "__qualname__", describe_value(self.speeds_from)))

    @property
    def uses_feedback(self) -> bool:
        """See :class:`tautwire.control.Design`."""
        return True


def state_space_controller(
    system: StateSpace,
    cable_count: int,
    aim: ControlAim | None = None,
    discretisation: str = "tustin",
    is_rigid: bool = False,
) -> RegulatorDesign:
    """Sampled-data controller from a linear one: deviations from the path in, deviations of the winch speeds out.

    Inputs are ``position_x`` to ``position_z`` in m, ``tension_i`` in N and ``winch_speed_i`` in m/s, measured minus
    reference, and of a platform that ``is_rigid`` ``rotation_x`` to ``rotation_z`` in rad, about the axes of the world;
    those that ``system`` labels, in any order, otherwise pose and tensions in this order. Outputs are
    all ``winch_speed_i``, beyond those of the reference. The sign of the feedback is included. A discrete ``dt`` is the
    sample period, a continuous system is discretised at ``aim.period`` by ``tustin`` or ``zoh`` (zero-order hold).

    Raises ArgumentError where signals, ``dt`` or values do not fit.
    """
    where = "state_space_controller: system"
    validate_instance(where, system, StateSpace, "convert it by control.ss")
    system, aim = _discrete(where, system, aim or ControlAim(), discretisation)
    freedoms = 6 if is_rigid else 3
    signals, sensors = regulator_signals(cable_count, freedoms), freedoms + cable_count
    inputs = _signal_indices(where, "input", system.input_labels, "u", signals["inputs"], sensors)
    speeds = signals["inputs"][sensors:]
    outputs = _signal_indices(where, "output", system.output_labels, "y", speeds, cable_count)
    if len(outputs) < cable_count:
        missing = ", ".join(name for i, name in enumerate(speeds) if i not in outputs)
        raise ArgumentError(where, system, f"has no output {missing}", "give it one for each winch")
    selection = np.zeros((system.ninputs, len(signals["inputs"])))
    selection[np.arange(system.ninputs), inputs] = 1.0
    C, D = np.zeros((cable_count, system.nstates)), np.zeros((cable_count, system.ninputs))
    C[outputs], D[outputs] = system.C, system.D
    identity, size = np.eye(cable_count), system.nstates
    # The last states are the speeds demanded a sample before: they delay, so that nothing feeds through.
    regulator = control.ss(
        np.block([[system.A, np.zeros((size, cable_count))], [C, np.zeros_like(identity)]]),
        np.vstack([system.B, D]) @ selection,
        np.hstack([np.zeros((cable_count, size)), identity / aim.period]),
        np.hstack([np.zeros((cable_count, sensors)), -identity / aim.period]),
        aim.period,
        remove_useless_states=False,
        **signals,
    )
    return RegulatorDesign(aim, regulator, np.zeros((regulator.nstates, cable_count)))


def function_controller(function: SpeedLaw, cable_count: int, aim: ControlAim | None = None) -> SpeedController:
    """Sampled-data controller from a function ``(time, measured) -> speeds``, called once every ``aim.period``.

    ``time`` in s; ``measured`` (3 + n,): x, y, z in m, then the tensions in N; of a platform that turns (7 + n,), with
    its unit quaternion w, x, y, z behind the position. ``speeds`` (n,) of the winches in m/s,
    positive reels in; not deviations. Limits are those of ``aim`` and the robot file. Where the function raises an
    exception, or returns other than n finite numbers, a run raises RunError, which has the run until then and as its
    ``cause`` a ControllerError.

    Raises ArgumentError where it is not a function.
    """
    where = "function_controller: function"
    if not callable(function) or isinstance(function, type):
        raise ArgumentError(where, function, f"is {describe_value(function)}, not a function", "give (time, measured)")
    return SpeedController(cable_count, _without_tare(aim), function)


def fmu_controller(
    path: str | Path, cable_count: int, aim: ControlAim | None = None, is_rigid: bool = False
) -> SpeedController:
    """Sampled-data controller from a co-simulation FMU, FMI 2.0 or 3.0, stepped by ``aim.period``.

    An FMU that is made for one period, its parameter ``period`` in s with equal bounds, has to be stepped by that:
    without ``aim`` it is.

    Its inputs, by name, are measured, ``position_x`` and ``tension_i``, of a platform that ``is_rigid`` also
    ``orientation_w`` to ``orientation_z``, or expected on the path, with ``reference_`` before these names;
    ``reference_winch_speed_i`` are the path's speeds when the demanded ones are reached. Outputs ``winch_speed_i``
    after the step are the demanded speeds; outputs ``winch_acceleration_i`` are added for a period. Case and separators
    do not matter: ``position.x`` and ``Tension[1]`` are such names too. ``speeds_from.inputs`` and
    ``speeds_from.outputs`` of the result are the matched variables with their signals.

    Raises ControllerFmuError where a variable or the period does not match, ArchiveError where the file is not an FMU.
    """
    file = validate_file("fmu_controller: path", path)
    controller = ControllerFmu(file, cable_count, is_rigid)
    period = controller.period
    if aim is None and period is not None:
        aim = ControlAim(period=period)
    elif aim is not None and period is not None and not isclose(aim.period, period, rel_tol=PERIOD_TOLERANCE):
        problem = f"it is made for samples every {period!r} s, aim.period is {aim.period!r} s"
        raise ControllerFmuError(file, None, problem, f"give ControlAim(period={period!r})")
    return SpeedController(cable_count, _without_tare(aim), controller)


def designed(where: str, controller: object, robot: Robot, aim: ControlAim | None, discretisation: str) -> Design | Any:
    """The controller as a design; what is not a known kind of controller is returned as it is."""
    if aim is not None:
        validate_instance(where.replace("controller", "aim"), aim, ControlAim, "give a ControlAim")
    cable_count, is_rigid = robot.cable_count, robot.platform.is_rigid_body
    if isinstance(controller, StateSpace):
        return state_space_controller(controller, cable_count, aim, discretisation, is_rigid)
    if isinstance(controller, control.InputOutputSystem | control.LTI):
        problem = f"is {describe_value(controller)}, not a StateSpace"
        raise ArgumentError(where, controller, problem, "convert it by control.ss")
    if isinstance(controller, str | Path):
        return fmu_controller(validate_file(where, controller), cable_count, aim, is_rigid)
    if callable(controller) and not isinstance(controller, type):
        return function_controller(controller, cable_count, aim)
    return controller


class SpeedControllerOnPath(PathController):
    """A :class:`SpeedController` as a source of winch speeds, see :class:`PathController`."""

    controller: SpeedController

    def _next_state(self, controller_state: ControllerState, measurement: list[float]) -> ControllerState:
        k, reference = controller_state.sample, self.reference
        speeds_to_come = reference.speeds[min(k + 2, len(self.times) - 1)]
        sample = Sample(float(self.times[k]), self.plan.period, measurement, reference.expected[k], speeds_to_come)
        speeds = _demanded_speeds(self.controller, sample)
        return law.state_after_demanded_speeds(self.plan, self.limits, controller_state, measurement, speeds)


@contextmanager
def path_source(
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    times: Array,
    seed: int | None = None,
    reference: Reference | None = None,
) -> Iterator[PathController]:
    """The controller on a path as a source of winch speeds; an FMU in it is freed when the block ends."""
    if not isinstance(controller, SpeedController):
        yield PathController(robot, controller, trajectory, times, seed, reference)
        return
    speeds_from = controller.speeds_from
    try:
        yield SpeedControllerOnPath(robot, controller, trajectory, times, seed, reference)
    finally:
        if isinstance(speeds_from, ControllerFmu):
            speeds_from.close()


def _without_tare(aim: ControlAim | None) -> ControlAim:
    return replace(aim or ControlAim(), tare=False)


def _demanded_speeds(controller: SpeedController, sample: Sample) -> list[float]:
    """The demanded speeds; raises ControllerError where they are not n finite numbers."""
    if isinstance(controller.speeds_from, ControllerFmu):
        speeds: object = controller.speeds_from.speeds(sample)
    else:
        assert controller.speeds_from is not None
        try:
            speeds = controller.speeds_from(sample.time, np.array(sample.measured))
        except (Exception, SystemExit) as error:
            problem = f"raised {type(error).__name__}: {error}"
            raise ControllerError(sample.time, sample.measured, problem) from error
    count = controller.cable_count
    try:
        values = np.asarray(speeds, dtype=float)
    except (TypeError, ValueError):
        problem = f"returned {describe_value(speeds)}, must return {count} numbers, the winch speeds"
        raise ControllerError(sample.time, sample.measured, problem) from None
    if values.shape != (count,):
        problem = f"returned the shape {values.shape}, must return ({count},), the winch speeds,"
        raise ControllerError(sample.time, sample.measured, problem)
    if not np.all(np.isfinite(values)):
        winch = int(np.argmin(np.isfinite(values)))
        problem = f"returned {values[winch]} m/s for winch {winch + 1}, must be finite,"
        raise ControllerError(sample.time, sample.measured, problem)
    return [float(value) for value in values]


def _discrete(where: str, system: StateSpace, aim: ControlAim, discretisation: str) -> tuple[StateSpace, ControlAim]:
    """The system in discrete time, and the aim with its period."""
    if discretisation not in DISCRETISATIONS:
        hint = f"give {suggest_name(str(discretisation), DISCRETISATIONS)}"
        raise ArgumentError("state_space_controller: discretisation", discretisation, "is unknown", hint)
    for name in "ABCD":
        if not np.all(np.isfinite(getattr(system, name))):
            raise ArgumentError(where, system, f"has entries of {name} that are not finite", "give finite matrices")
    if system.dt is None or system.dt is True:
        hint = "give it dt=0 for continuous time, or its sample period in s"
        raise ArgumentError(where, system, f"has no sample period, its dt is {system.dt}", hint)
    if system.dt > 0.0:
        return system, replace(aim, period=float(system.dt))
    if discretisation == "tustin" and system.nstates:
        distances = np.abs(system.poles() * aim.period / 2.0 - 1.0)
        if np.min(distances) < 1e-9:
            problem = f"has a pole at {2.0 / aim.period:g} 1/s, where Tustin's method divides by zero"
            raise ArgumentError(where, system, problem, "choose zoh, or another period")
    return control.sample_system(system, aim.period, method=discretisation), aim


def _signal_indices(
    where: str, kind: str, labels: Sequence[str], prefix: str, known: Sequence[str], expected_count: int
) -> list[int]:
    """Index of each signal among the known ones: by its label, or by order where labels are python-control's own."""
    if list(labels) == [f"{prefix}[{i}]" for i in range(len(labels))]:
        if len(labels) != expected_count:
            hint = f"label them by names such as {known[0]}, or give {', '.join(known[:expected_count])}"
            raise ArgumentError(where, labels, f"has {len(labels)} {kind}s, must have {expected_count}", hint)
        return list(range(expected_count))
    for label in labels:
        if label not in known:
            raise ArgumentError(where, label, f"has the {kind} {label!r}", f"label it {suggest_name(label, known)}")
    return [list(known).index(label) for label in labels]
