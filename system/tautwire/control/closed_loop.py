"""The FMUs under a controller: one at work in our master, or one that is an FMU itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..fmus.packaging import RobotFmus, build_controller
from ..master import Connection, FixedStep, Port, Progress, Source
from ..robots.robot import Robot
from ..runs.cosimulation import ALONE, STEP, Beside, Motion, run, wired
from ..runs.wiring import AXES, PLATFORM, winch_ports
from ..trajectory import Trajectory
from .design import Design
from .feedforward import elastic_reference
from .path import Reference
from .plan import plan_data
from .source import PathController

Array = NDArray[np.float64]

CONTROLLER = "controller"
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
    push: Array | None = None,
) -> Motion:
    """Co-simulate the FMUs with the controller over whole samples until ``duration`` (s) is reached.

    ``robot`` is what the controller believes; it follows ``reference``, by default that of the elastic model. ``step``
    bounds the macro step in s; ``seed`` switches the noise of the robot's sensors on; ``push`` (N, 3) is an external
    force in N, held from sample to sample. ``patience`` is as for :func:`tautwire.runs.cosimulation.record`. Returns
    the run at the controller's samples.

    With winches the speeds that the controller wants are what these are asked for.

    Raises UnreachableError where the path asks a cable to push, InputError where an FMU does not show a tension or
    robot, controller and FMUs do not go together.
    """
    _require_cables(fmus, robot, controller)
    _require_tensions(fmus, robot)
    times = sample_times(controller.aim.period, duration)
    source: Source = PathController(robot, controller, trajectory, times, seed, reference)
    beside = ALONE
    if push is not None:
        source, beside = Joined((source, Push(push))), Beside(also=PUSHED)
    return run(fmus, source, times, FixedStep(step), progress, patience, beside)


def build_controller_fmu(
    robot: Robot,
    controller: Design,
    trajectory: Trajectory,
    duration: float,
    folder: Path,
    reference: Reference | None = None,
) -> Path:
    """Write ``controller.fmu`` into ``folder``: the controller with its path until ``duration`` (s), where it rests.

    ``reference`` is at the controller's samples, by default that of the elastic model. Its inputs are the measured
    position and tensions, its outputs winch speeds and their rates.

    Raises UnreachableError where the path asks a cable to push.
    """
    times = sample_times(controller.aim.period, duration)
    reference = reference or elastic_reference(robot, trajectory, times)
    return build_controller(plan_data(robot, controller, reference), folder)


def cosimulate_with_controller(
    fmus: RobotFmus,
    controller: Path,
    time: Array,
    step: float = STEP,
    push: Array | None = None,
    progress: Progress | None = None,
    patience: float | None = None,
) -> Motion:
    """Co-simulate a robot's FMUs wired to a controller that is an FMU too, as :func:`build_controller_fmu` writes it.

    ``time`` (N,) in s, rising, from 0; macro steps are no longer than ``step`` (s) and end at each of these times: let
    them hold the controller's samples. ``push`` (N, 3) is an external force in N, held from time to time.

    Raises RunError where an FMU fails.
    """
    wires = controller_wires(fmus)
    still = Still(len(winch_ports(len(fmus.cables))))
    if push is None:
        beside, source = Beside({CONTROLLER: controller}, wires), Joined((still,))
    else:
        beside, source = Beside({CONTROLLER: controller}, wires, PUSHED), Joined((still, Push(push)))
    return run(fmus, source, time, FixedStep(step), progress, patience, beside)


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


def _require_cables(fmus: RobotFmus, robot: Robot, controller: Design) -> None:
    counts = {len(fmus.cables), robot.cable_count, controller.cable_count}
    if len(counts) > 1:
        told = f"has {robot.cable_count} cables, the controller {controller.cable_count}, the FMUs {len(fmus.cables)}"
        raise InputError(robot.name, told, "give those of one robot")


def _require_tensions(fmus: RobotFmus, robot: Robot) -> None:
    unseen = [name for name in wired(fmus).unrecorded if name.startswith("tension")]
    if unseen:
        raise InputError(robot.name, f"the controller needs {', '.join(unseen)}, no FMU shows it", "let one show it")
