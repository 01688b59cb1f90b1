"""The FMUs under a controller: one at work in our master, or one that is an FMU itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import file_of, folder_of, having, number_of, of_kind, robot_of, whole_number_of
from ..array_arguments import array_of, rising_of
from ..errors import InputError
from ..fmus.packaging import RobotFmus, build_controller
from ..master import Connection, FixedStep, Port, Progress, Source
from ..robots.robot import Robot
from ..runs.asked import require_fmus, require_options
from ..runs.cosimulation import ALONE, STEP, TIMES, Beside, Motion, run, wired
from ..runs.wiring import AXES, PLATFORM, winch_ports
from ..trajectory import DURATION as OF_PATH
from ..trajectory import Trajectory, trajectory_of
from .design import Design
from .feedforward import elastic_reference
from .path import Reference
from .plan import plan_data
from .source import PathController

Array = NDArray[np.float64]

CONTROLLER = "controller"
DURATION = OF_PATH._replace(meaning="how long the run takes")
DESIGN = ("aim", "cable_count", "feels", "knots")
PUSHED = tuple(Port(PLATFORM, f"{name}.{axis}") for axis in AXES for name in ("external_force", "external_force_rate"))


@dataclass(frozen=True)
class Push:
    """An external force on the platform: ``forces`` (N, 3) in N, each held from its sample to the next."""

    forces: Array

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.master.Source`."""
        held = np.column_stack([self.forces[index], np.zeros(3)]).ravel()
        return held, held


@dataclass(frozen=True)
class Still:
    """Inputs that stay zero, ``count`` of them."""

    count: int

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.master.Source`."""
        return np.zeros(self.count), np.zeros(self.count)


@dataclass(frozen=True)
class Joined:
    """The inputs that each of some sources drives, one after the other."""

    sources: tuple[Source, ...]

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.master.Source`."""
        pairs = [source.interval(index, time, step, shown) for source in self.sources]
        return np.concatenate([start for start, _ in pairs]), np.concatenate([end for _, end in pairs])


def sample_times(period: float, duration: float) -> Array:
    """Whole samples of ``period`` (s) until ``duration`` (s) is reached."""
    count = int(np.ceil(duration / period * (1.0 - 1e-9))) + 1
    return np.linspace(0.0, (count - 1) * period, count)


def cosimulate_closed_loop(
    fmus: RobotFmus,
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    step: float = STEP,
    seed: int | None = None,
    progress: Progress | None = None,
    patience: float | None = None,
    reference: Reference | None = None,
    push: ArrayLike | None = None,
) -> Motion:
    """Co-simulate the FMUs with the controller over whole samples until ``duration`` (s) is reached, N of them.

    ``robot`` is what the controller believes; it follows ``reference`` at its samples, by default that of the elastic
    model. ``step`` bounds the macro step in s; ``seed`` switches the noise of the robot's sensors on; ``push`` (N, 3)
    is an external force in N, held from sample to sample. ``progress`` and ``patience`` are as for
    :func:`tautwire.cosimulate`. Returns the run at the controller's samples.

    With winches the speeds that the controller wants are what these are asked for.

    Raises UnreachableError where the path asks a cable to push, StretchError where no speeds follow it, RunError where
    an FMU fails, InputError where an FMU does not show a tension or robot, controller and FMUs do not go together,
    ArgumentError where an argument is none of these.
    """
    name = "cosimulate_closed_loop"
    _require_loop(name, fmus, robot, controller, trajectory, duration, seed)
    require_options(name, step, None, progress, patience)
    times = sample_times(controller.aim.period, duration)
    if reference is not None:
        _require_reference(name, reference, len(times), robot.cable_count)
    source: Source = PathController(robot, controller, trajectory, times, seed, reference)
    beside = ALONE
    if push is not None:
        forces = _require_push(name, push, len(times))
        source, beside = Joined((source, Push(forces))), Beside(also=PUSHED)
    return run(fmus, source, times, FixedStep(step), progress, patience, beside)


def build_controller_fmu(
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    folder: str | Path,
    reference: Reference | None = None,
) -> Path:
    """Write ``controller.fmu`` into ``folder``: the controller with its path until ``duration`` (s), where it rests.

    ``reference`` is at the controller's samples, by default that of the elastic model. Its inputs are the measured
    position and tensions, its outputs winch speeds and their rates.

    Raises UnreachableError where the path asks a cable to push, ArgumentError where an argument is none of these.
    """
    _require_design("build_controller_fmu", robot, controller, trajectory)
    number_of("build_controller_fmu: duration", duration, DURATION)
    place = folder_of("build_controller_fmu: folder", folder)
    times = sample_times(controller.aim.period, duration)
    if reference is not None:
        _require_reference("build_controller_fmu", reference, len(times), robot.cable_count)
    return build_controller(
        plan_data(robot, controller, reference or elastic_reference(robot, trajectory, times)), place
    )


def cosimulate_with_controller(
    fmus: RobotFmus,
    controller: str | Path,
    time: ArrayLike,
    step: float = STEP,
    push: ArrayLike | None = None,
    progress: Progress | None = None,
    patience: float | None = None,
) -> Motion:
    """Co-simulate a robot's FMUs wired to a controller that is an FMU too, as :func:`build_controller_fmu` writes it.

    ``time`` (N,) in s, rising, from 0; macro steps are no longer than ``step`` (s) and end at each of these times: let
    them hold the controller's samples. ``push`` (N, 3) is an external force in N, held from time to time.

    Raises RunError where an FMU fails, ArgumentError where an argument is none of these.
    """
    name = "cosimulate_with_controller"
    require_fmus(f"{name}: fmus", fmus)
    parts = {CONTROLLER: file_of(f"{name}: controller", controller)}
    moments = rising_of(f"{name}: time", time, TIMES)
    require_options(name, step, None, progress, patience)
    wires = controller_wires(fmus)
    still = Still(len(winch_ports(len(fmus.cables))))
    if push is None:
        beside, source = Beside(parts, wires), Joined((still,))
    else:
        forces = _require_push(name, push, len(moments))
        beside, source = Beside(parts, wires, PUSHED), Joined((still, Push(forces)))
    return run(fmus, source, moments, FixedStep(step), progress, patience, beside)


def controller_wires(fmus: RobotFmus) -> tuple[Connection, ...]:
    """What a controller is shown, and what it drives in place of the master."""
    count, wiring = len(fmus.cables), wired(fmus)
    seen = [*(f"position.{axis}" for axis in AXES), *(f"tension_{i}" for i in range(1, count + 1))]
    shown = [*wiring.shown[:3], *wiring.shown[6 : 6 + count]]
    asked = [f"{name}_{i}" for i in range(1, count + 1) for name in ("winch_speed", "winch_acceleration")]
    ports = winch_ports(count, fmus.winch_numbers)
    return (
        *(Connection(port, Port(CONTROLLER, name)) for port, name in zip(shown, seen, strict=True)),
        *(Connection(Port(CONTROLLER, asked[place]), ports[place]) for place in wiring.driven),
    )


def _require_loop(
    name: str,
    fmus: RobotFmus,
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    seed: int | None,
) -> None:
    """Refuse what no controller can be run with."""
    require_fmus(f"{name}: fmus", fmus)
    _require_design(name, robot, controller, trajectory)
    number_of(f"{name}: duration", duration, DURATION)
    if seed is not None:
        whole_number_of(f"{name}: seed", seed, 0, "give a whole number, or None for no noise")
    _require_cables(fmus, robot, controller)
    _require_tensions(fmus, robot)


def _require_design(name: str, robot: Robot, controller: Design, trajectory: Trajectory) -> None:
    robot_of(f"{name}: robot", robot)
    having(f"{name}: controller", controller, DESIGN, "controller", "give what design_controller returns")
    trajectory_of(f"{name}: trajectory", trajectory)


def _require_push(name: str, push: ArrayLike, count: int) -> Array:
    meaning = "finite forces in N, a row for each sample and columns x, y, z"
    return array_of(f"{name}: push", push, (count, 3), meaning)


def _require_reference(name: str, reference: Reference, count: int, cables: int) -> None:
    where = f"{name}: reference"
    of_kind(where, reference, Reference, "give what elastic_reference returns")
    meaning = f"that of the controller's {count} samples, sample_times(period, duration)"
    for part, width in {"speeds": cables, "rigid": cables, "expected": 3 + cables}.items():
        array_of(f"{where}.{part}", getattr(reference, part), (count, width), meaning)


def _require_cables(fmus: RobotFmus, robot: Robot, controller: Design) -> None:
    counts = {len(fmus.cables), robot.cable_count, controller.cable_count}
    if len(counts) > 1:
        told = f"has {robot.cable_count} cables, the controller {controller.cable_count}, the FMUs {len(fmus.cables)}"
        raise InputError(robot.name, told, "give those of one robot")


def _require_tensions(fmus: RobotFmus, robot: Robot) -> None:
    unseen = [name for name in wired(fmus).unrecorded if name.startswith("tension")]
    if unseen:
        raise InputError(robot.name, f"the controller needs {', '.join(unseen)}, no FMU shows it", "let one show it")
