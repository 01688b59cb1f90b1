"""The moves, controllers and robots of the controllers' bench, and what is measured of a run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tautwire.control import (
    ClosedLoopOptions,
    Design,
    Feedforward,
    Range,
    Reference,
    cosimulate_closed_loop,
    design_controller,
    design_robust,
    elastic_reference,
    rigid_reference,
    sample_times,
    schedule_controller,
    schedule_robust,
    shape_along,
)
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.kinematics import inverse_kinematics
from tautwire.robot.pose_path import pose_path, sample_poses
from tautwire.robot.pose_trajectory import PoseTrajectory, rotation_vectors_between, slerp
from tautwire.robot.schema import Robot
from tautwire.robot.trajectory import CAROCA_HELIX, PAPER_HELIX, Line, Trajectory
from tautwire_fmu.laws.rotation import multiply
from tests.support.robots import example
from tests.support.winch_ramp import WinchRamp

Array = NDArray[np.float64]

PERIOD = 0.01
SEED = 1
OPEN, FORWARD, LQG, ROBUST = "open loop", "feedforward", "LQG", "robust"
SHAPED = {"ZV shaped": "ZV", "EI shaped": "EI"}


@dataclass(frozen=True)
class Move:
    """A path, or a place with a ``push`` (N) from ``settles`` (s) on; settled is who stays within ``near`` (m).

    ``swings`` is when the swing that is left is looked at, in s.
    """

    name: str
    robot: Robot
    path: Trajectory
    duration: float
    settles: float
    near: float
    swings: float
    push: Array | None = None

    @property
    def times(self) -> Array:
        """The samples, in s."""
        return sample_times(PERIOD, self.duration)


@dataclass(frozen=True)
class Controlled:
    """A controller on a move: what it is designed as, the path it follows, and its reference."""

    design: Design
    path: Trajectory
    reference: Reference


@dataclass(frozen=True)
class Measured:
    """Of a run: distances from the path in m, largest angle in rad, times in s, tensions in N, effort in m/s^2."""

    rms: float
    peak: float
    settling: float
    swing: float
    highest: float
    lowest: float
    effort: float
    angle: float = 0.0

    def worst(self, other: Measured) -> Measured:
        """Of two runs, number by number."""
        results = {name: max(value, vars(other)[name]) for name, value in vars(self).items()}
        return replace(Measured(**results), lowest=min(self.lowest, other.lowest))


def moves() -> list[Move]:
    """The paper's helix and ramp on its three-cable robot, a force step there, CAROCA's helix, and a turn of CoGiRo."""
    three, caroca, cogiro = (example(name) for name in ("three", "caroca", "cogiro"))
    start = three.platform.start
    push = np.zeros((len(sample_times(PERIOD, 9.0)), 3))
    push[100:] = -0.05 * three.platform.mass * three.gravity * np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    return [
        Move("Helix of the paper, three cables", three, PAPER_HELIX, 54.0, 50.0, 1e-3, 53.0),
        Move("Ramp of the paper, three cables", three, WinchRamp(three, 12.0), 10.0, 4.0, 1e-3, 7.0),
        Move("Force of 5 % of the weight, three cables", three, Line(start, start, 1.0), 9.0, 1.0, 1e-3, 7.0, push),
        Move("Helix of the paper, CAROCA", caroca, CAROCA_HELIX, 7.0, 4.0, 2e-4, 6.0),
        Move("Line and turn by 0.2 rad, CoGiRo", cogiro, _line_and_turn(cogiro), 4.0, 2.0, 2e-4, 3.0),
    ]


def _line_and_turn(robot: Robot) -> PoseTrajectory:
    """Half a metre, and a turn about a tilted axis meanwhile."""
    x, y, z = robot.platform.start
    start = robot.platform.start_orientation
    w, a, b, c = multiply((np.cos(0.1), 0.48 * np.sin(0.1), 0.64 * np.sin(0.1), 0.6 * np.sin(0.1)), start)
    return PoseTrajectory(Line((x, y, z), (x + 0.3, y - 0.3, z + 0.26), 2.0), slerp(start, (w, a, b, c), 2.0))


def designs(move: Move) -> dict[str, Design]:
    """The feedback designs for a move; the robust ones, which take minutes with eight cables, of point masses only."""
    results: dict[str, Design] = {LQG: design_controller(move.robot)}
    if move.robot.platform.is_rigid_body:
        return results | {f"{LQG}, scheduled": schedule_controller(move.robot, move.path)}
    results[ROBUST] = design_robust(move.robot)
    if move.push is None:
        results[f"{LQG}, scheduled"] = schedule_controller(move.robot, move.path)
        results[f"{ROBUST}, scheduled"] = schedule_robust(move.robot, move.path)
    return results


def controlled(move: Move, feedback: dict[str, Design]) -> dict[str, Controlled]:
    """Every controller of the bench on a move."""
    robot, times = move.robot, move.times
    blind = Feedforward(robot.cable_count)
    rigid = rigid_reference(robot, move.path, times)
    results = {OPEN: Controlled(blind, move.path, rigid)}
    if move.push is None:
        elastic = elastic_reference(robot, move.path, times)
        results[FORWARD] = Controlled(blind, move.path, elastic)
        for name, kind in SHAPED.items():
            path = shape_along(robot, move.path, kind)  # type: ignore[arg-type]
            results[name] = Controlled(blind, path, rigid_reference(robot, path, times))
    else:
        elastic = rigid
    return results | {name: Controlled(design, move.path, elastic) for name, design in feedback.items()}


def robots(move: Move, folder: Path) -> Iterator[tuple[bool, RobotFmus]]:
    """FMUs of the robot as declared, then of those at the corners of the range; tells which is which."""
    yield True, build_fmus(move.robot, folder / "declared")
    for modulus, payload, robot in Range.of(move.robot).robots(move.robot, 2):
        yield False, build_fmus(robot, folder / f"{modulus:g}-{payload:g}")


def run(move: Move, controller: Controlled, fmus: RobotFmus) -> CosimulationResult:
    """One run, sensors with noise."""
    return cosimulate_closed_loop(
        fmus,
        move.robot,
        controller.design,
        controller.path,
        move.duration,
        ClosedLoopOptions(seed=SEED, reference=controller.reference, external_force=move.push),
    )


def measured(move: Move, controller: Controlled, motion: CosimulationResult) -> Measured:
    """The numbers of a run; settling counts from the end of the move, as the controller has shaped it."""
    poses = sample_poses("bench", move.robot, pose_path(move.robot, controller.path), motion.time)
    away = motion.position - poses.position
    distance = np.linalg.norm(away, axis=1)
    late = max(controller.path.duration - move.path.duration, 0.0)
    outside = np.flatnonzero(distance > move.near)
    settled = 0.0 if not len(outside) else motion.time[outside[-1]] - move.settles - late
    wound = motion.elongation - motion.length
    orientations = [(w, x, y, z) for w, x, y, z in poses.orientation.tolist()]
    pairs = zip(poses.position, orientations, strict=True)
    ideal = np.array([inverse_kinematics(move.robot, *pair) for pair in pairs])
    angle = 0.0
    if motion.orientation is not None:
        angles = np.linalg.norm(rotation_vectors_between(motion.orientation, poses.orientation), axis=1)
        angle = float(np.max(angles))
    beyond = np.diff(wound + ideal, 2, axis=0) / PERIOD**2
    return Measured(
        rms=float(np.sqrt(np.mean(distance**2))),
        peak=float(np.max(distance)),
        settling=np.inf if distance[-1] > move.near else max(float(settled), 0.0),
        swing=swing(motion.time, away, move.swings),
        highest=float(np.max(motion.tension)),
        lowest=float(np.min(motion.tension)),
        effort=float(np.sqrt(np.mean(beyond**2))),
        angle=angle,
    )


def swing(times: Array, away: Array, begin: float) -> float:
    """Largest swing about a smooth motion after a time, in m."""
    return float(np.max(np.linalg.norm(about_smooth(times, away, begin), axis=1)))


def about_smooth(times: Array, away: Array, begin: float) -> Array:
    """What is left of lengths (N, 3) after a time when their cubics in time are taken away."""
    late = times >= begin
    smooth = np.vander(np.interp(times[late], [begin, times[-1]], [-1.0, 1.0]), 4)
    left: Array = away[late] - smooth @ np.linalg.lstsq(smooth, away[late], rcond=None)[0]
    return left
