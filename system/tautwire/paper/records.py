"""Runs of the paper's robots by FMUs and master, and what is kept of each: series by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from ..fmus.packaging import build_fmus
from ..robots.robot import Robot
from ..runs.cosimulation import Motion, cosimulate
from ..trajectory import Trajectory, ideal_winch_speeds
from .parameters import Ramp, with_start

Array = NDArray[np.float64]
Tell = Callable[[str, float], None]

STEP = 0.1  # s, macro steps; micrometres off on the ramps
SETTLED, SWEEPS = 1e-12, 30


@dataclass(frozen=True)
class Case:
    """What one run takes: winch speeds (N, n) in m/s at ``time`` (N,) in s, and where the platform should be (N, 3)."""

    robot: Robot
    time: Array
    winch_speed: Array
    desired: Array


@dataclass(frozen=True)
class Record:
    """Series (N,) by name over ``time`` (N,) in s, SI units.

    Of a run: ``tension_1``, ``elongation_1``, ``strain_1`` (the paper's r / l), ``length_1``, ``winch_speed_1`` ...;
    ``x``, ``vx``, ``error_x`` ... (desired less real); ``error_norm``. ``made`` is the energy that the coupling made as
    a share of all that was exchanged.
    """

    time: Array
    values: Mapping[str, Array] = field(repr=False)
    made: float = 0.0

    def __getitem__(self, name: str) -> Array:
        return self.values[name]

    def at(self, name: str, moment: float) -> float:
        """A series at a moment in s, linear between samples."""
        return float(np.interp(moment, self.time, self.values[name]))


Records = Mapping[str, Record]


class RigidPathError(TautwireError):
    """Ropes of given lengths meet nowhere near where they were before; ``moment`` in s."""

    def __init__(self, robot: str, moment: float) -> None:
        self.robot = robot
        self.moment = moment
        super().__init__(f"{robot}: inelastic ropes meet nowhere at {moment:g} s")


def helix_case(robot: Robot, path: Trajectory, samples: int) -> Case:
    """A path followed with the winch speeds of inelastic ropes, in so many intervals."""
    time = np.linspace(0.0, path.duration, samples + 1)
    return Case(robot, time, ideal_winch_speeds(robot, path, time), path.position(time))


def ramp_case(robot: Robot, ramp: Ramp, samples: int) -> Case:
    """A ramp of the winches; desired is where inelastic ropes would lead. Bends of the ramp have to be samples."""
    placed = with_start(robot, ramp.start)
    time = np.linspace(0.0, ramp.duration, samples + 1)
    speeds = ramp.speeds(time)
    return Case(placed, time, speeds, rigid_path(placed, time, speeds))


def rigid_path(robot: Robot, time: Array, winch_speed: Array) -> Array:
    """Where three inelastic ropes lead the platform, (N, 3) in m: ``|p - b_i| = l_i(0) - integral V_i dt``, by Newton.

    ``time`` (N,) in s; ``winch_speed`` (N, 3) in m/s, linear in between. Raises RigidPathError.
    """
    anchors, position = np.array(robot.anchors), np.array(robot.platform.start)
    lengths = np.linalg.norm(position - anchors, axis=1) - travelled(time, winch_speed)
    path = np.empty((len(time), 3))
    for row, wanted in enumerate(lengths):
        for _ in range(SWEEPS):
            spans = position - anchors
            found = np.linalg.norm(spans, axis=1)
            change = np.linalg.solve(spans / found[:, None], wanted - found)
            position = position + change
            if np.max(np.abs(change)) < SETTLED * np.max(found):
                break
        else:
            raise RigidPathError(robot.name, float(time[row]))
        path[row] = position
    return path


def travelled(time: Array, winch_speed: Array) -> Array:
    """Rope reeled in since the start, in m, of speeds (N, n) that are linear between samples."""
    slices = 0.5 * np.diff(time)[:, None] * (winch_speed[1:] + winch_speed[:-1])
    return np.vstack([np.zeros(winch_speed.shape[1]), np.cumsum(slices, axis=0)])


def run_case(case: Case) -> Record:
    """Build the FMUs of a case and co-simulate them; raises RunError where an FMU fails."""
    with TemporaryDirectory(prefix="tautwire-paper-") as folder:
        fmus = build_fmus(case.robot, Path(folder))
        return record_of(cosimulate(fmus, case.time, case.winch_speed, step=STEP), case)


def record_of(motion: Motion, case: Case) -> Record:
    """The series of a run."""
    return Record(motion.time, dict(_series(motion, case)), motion.account.share)


def _series(motion: Motion, case: Case) -> Iterator[tuple[str, Array]]:
    error = case.desired - motion.position
    for place, axis in enumerate("xyz"):
        yield axis, motion.position[:, place]
        yield f"v{axis}", motion.velocity[:, place]
        yield f"error_{axis}", error[:, place]
    yield "error_norm", np.linalg.norm(error, axis=1)
    for place in range(case.robot.cable_count):
        number = place + 1
        yield f"tension_{number}", motion.tension[:, place]
        yield f"length_{number}", motion.length[:, place]
        yield f"elongation_{number}", motion.elongation[:, place]
        yield f"strain_{number}", motion.elongation[:, place] / motion.length[:, place]
        yield f"winch_speed_{number}", case.winch_speed[:, place]
