"""One run of a campaign as a pure function: what all runs share and the numbers of this one in, a row out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import log
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects.slack import SLACK

from ..control import cosimulate_closed_loop
from ..errors import one_line
from ..fmus.packaging import RobotFmus
from ..linear import linearise
from ..linear.modes import POSITION, VELOCITY
from ..linear.plant import LinearPlant
from ..recordings.recording import Recording
from ..robots.reading import robot_from
from ..robots.robot import Robot
from ..runs.cosimulation import Motion, cosimulate
from ..runs.start import placed
from ..runs.wiring import AXES
from ..statics.equilibrium import static_tensions
from .built import Bundle, bundled, fmus_of
from .drive import Drive, drive_of, start_of_path
from .keys import with_values
from .plan import Plan
from .rows import FAILURE, MODES, Row, series_columns

Array = NDArray[np.float64]
Series = dict[str, Array]

LONGEST_REASON = 2000


@dataclass(frozen=True)
class Job:
    """One run: its ``index``, its ``sample``, its variant of path and controller, and its inputs' values."""

    index: int
    sample: int
    variant: int
    values: tuple[float | str, ...] = ()


@dataclass(frozen=True)
class Shared:
    """What all runs of a plan share; ``drives`` by variant where they do not depend on the run."""

    plan: Plan
    recordings: Mapping[str, Recording]
    bundle: Bundle | None = None
    drives: Mapping[int, Drive] = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    """What a run came to: a ``row`` by columns, and its ``series`` by columns, empty where nothing is kept."""

    row: Row
    series: Series = field(default_factory=dict)


def shared_of(plan: Plan, recordings: Mapping[str, Recording]) -> Shared:
    """Build the FMUs and design the controllers that all runs share.

    Raises what building and designing raise where the robot file as it stands cannot follow a path.
    """
    if not plan.paths:
        return Shared(plan, recordings)
    robot = robot_from(dict(plan.content), plan.file)
    bundle = bundled(placed(robot, start_of_path(robot, plan.paths[0])))
    drives = {
        place: drive_of(robot, plan.paths[path], controller, plan.compute, recordings)
        for place, (path, controller) in enumerate(plan.variants)
    }
    varies = plan.belief == "varied" or any(key.startswith("platform.start") for key in plan.keys)
    return Shared(plan, recordings, bundle, {} if varies else drives)


def run_job(shared: Shared, job: Job, folder: Path) -> Result:
    """Make one run; what it fails with is its row's reason, beside what came before that.

    The row depends on the plan and the job alone. ``folder`` keeps FMUs from run to run.

    Raises OSError where the machine fails, not the run.
    """
    path, controller = shared.plan.variants[job.variant]
    row: Row = {"index": job.index, "sample": job.sample}
    if path >= 0:
        row |= {"path": shared.plan.paths[path].name, "controller": controller}
    row |= dict(zip(shared.plan.keys, job.values, strict=True))
    series: Series = {}
    try:
        for numbers, kept in _stages(shared, job, folder):
            row |= numbers
            series = kept
    except OSError:
        raise
    except Exception as error:
        row[FAILURE] = reason_of(error)
    return Result(row, series)


def reason_of(error: BaseException) -> str:
    """An error as one line of a row."""
    said = one_line(" ".join(str(error).split())) or "no message"
    return f"{type(error).__name__}: {said}"[:LONGEST_REASON]


def _stages(shared: Shared, job: Job, folder: Path) -> Iterable[tuple[Row, Series]]:
    plan = shared.plan
    robot = robot_from(with_values(plan.content, dict(zip(plan.keys, job.values, strict=True))), plan.file)
    place, controller = plan.variants[job.variant]
    if place >= 0:
        robot = placed(robot, start_of_path(robot, plan.paths[place]))
    if plan.compute.statics:
        yield {"held": False}, {}
        tensions = static_tensions(robot)
        yield (
            {"held": True} | {f"static_tension_{cable}": float(each) for cable, each in enumerate(tensions, start=1)},
            {},
        )
    if plan.compute.modes:
        yield _modes(robot, linearise(robot)), {}
    if place >= 0 and shared.bundle is not None:
        drive = shared.drives.get(job.variant) or drive_of(
            _believed(robot, plan), plan.paths[place], controller, plan.compute, shared.recordings
        )
        motion = _moved(fmus_of(robot, shared.bundle, folder), drive, plan, job)
        yield _numbers(robot, drive, motion), _series(motion, plan.compute.series)


def _believed(robot: Robot, plan: Plan) -> Robot:
    """What controllers and winch speeds are made for."""
    if plan.belief == "varied":
        return robot
    return placed(robot_from(dict(plan.content), plan.file), robot.platform.start)


def _modes(robot: Robot, plant: LinearPlant) -> Row:
    """Frequencies, damping ratios, and the least eigenvalue of the stiffness that the platform feels."""
    modes, A, B = plant.modes, plant.system.A, plant.system.B
    stiffness = -np.linalg.solve(B[VELOCITY, robot.cable_count :], A[VELOCITY, POSITION])
    least = float(np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0])
    frequencies = {f"frequency_{mode}": float(modes.frequencies[mode - 1]) for mode in MODES}
    ratios = {f"damping_ratio_{mode}": float(modes.damping_ratios[mode - 1]) for mode in MODES}
    return {**frequencies, **ratios, "stiffness_least": least}


def _moved(fmus: RobotFmus, drive: Drive, plan: Plan, job: Job) -> Motion:
    if drive.speeds is not None:
        return cosimulate(fmus, drive.time, drive.speeds, plan.compute.step)
    if drive.design is None or drive.trajectory is None:
        raise ValueError("a drive without speeds needs a controller and its path")
    seed = int(np.random.SeedSequence((plan.seed, job.index)).generate_state(1)[0]) if plan.compute.noise else None
    return cosimulate_closed_loop(
        fmus,
        drive.believed,
        drive.design,
        drive.trajectory,
        float(drive.time[-1]),
        plan.compute.step,
        seed,
        reference=drive.reference,
    )


def _numbers(robot: Robot, drive: Drive, motion: Motion) -> Row:
    """Where a motion ended, how far it was from its path, and what its tensions were."""
    row: dict[str, Any] = {f"end_{axis}": float(each) for axis, each in zip(AXES, motion.position[-1], strict=True)}
    if drive.wanted is not None:
        apart = np.linalg.norm(motion.position - drive.wanted, axis=1)
        errors = {"end": apart[-1], "largest": apart.max(), "rms": np.sqrt(np.mean(apart**2))}
        row |= {f"path_error_{name}": float(value) for name, value in errors.items()}
    least, largest = motion.tension.min(axis=0), motion.tension.max(axis=0)
    for cable in robot.cable_numbers:
        row |= {f"tension_{cable}_least": float(least[cable - 1])}
        row |= {f"tension_{cable}_largest": float(largest[cable - 1])}
    row["slack"] = bool(np.any(least <= _without_pull(robot)))
    if robot.tension is not None:
        row["limit_broken"] = bool(least.min() < robot.tension.minimum or largest.max() > robot.tension.maximum)
    return row


def _without_pull(robot: Robot) -> Array:
    """The tension (n,) in N of a cable that nothing pulls at: zero, or ``s ln 2`` of the effect slack's softness s."""
    left = np.zeros(robot.cable_count)
    for setting in robot.effects:
        if setting.name == SLACK.name:
            left[[cable - 1 for cable in setting.cables]] = setting.values["softness"] * log(2.0)
    return left


def _series(motion: Motion, points: int) -> Series:
    """Positions and tensions at evenly spread times, from a motion's start to its end."""
    if points < 2:
        return {}
    time = np.linspace(motion.time[0], motion.time[-1], points)
    shown = motion.measured()
    names = series_columns(motion.tension.shape[1])
    return {"time": time} | {
        name: np.interp(time, motion.time, column) for name, column in zip(names, shown.T, strict=True)
    }
