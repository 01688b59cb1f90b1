"""One run of a campaign as a pure function: co-simulation along its reference input, outputs as a row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..control import ClosedLoopOptions, cosimulate_closed_loop
from ..cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from ..errors import one_line
from ..fmus.packaging import RobotFmus
from ..linear import linearise
from ..linear.linear_plant import LinearPlant
from ..recordings.recording import Recording
from ..recordings.start_position import with_start
from ..robot.platform_symbols import StateIndices
from ..robot.pose_trajectory import rotation_vectors_between
from ..robot.robot_file_reader import robot_from_content
from ..robot.schema import AXES, Robot
from ..robot.static_equilibrium import static_tensions
from ..robot.static_load import slack_tensions
from .campaign_plan import Plan
from .dataset_schema import FAILURE_COLUMN, ORIENTATION_COLUMNS, Row, mode_numbers, series_columns
from .fmu_cache import FmuBundle, build_bundle, cached_fmus
from .parameter_space import with_values
from .reference_input import ReferenceInput, at_path_start, build_reference_input
from .true_motion import without_gains_and_offsets, without_sensor_effects

Array = NDArray[np.float64]

Series = dict[str, Array]
MAX_REASON_LENGTH = 2000


@dataclass(frozen=True)
class Job:
    """One run: its ``index``, its ``sample``, its variant of path and controller, and its inputs' values."""

    index: int
    sample: int
    variant: int
    values: tuple[float | str, ...] = ()


@dataclass(frozen=True)
class CampaignContext:
    """Context that all runs of a plan share; ``reference_inputs`` by variant where they do not depend on the run."""

    plan: Plan
    recordings: Mapping[str, Recording]
    bundle: FmuBundle | None = None
    reference_inputs: Mapping[int, ReferenceInput] = field(default_factory=dict)


@dataclass(frozen=True)
class RunResult:
    """Result of a run: a ``row`` by column, and its time ``series`` by column, empty where none is stored."""

    row: Row
    series: Series = field(default_factory=dict)


def build_context(plan: Plan, recordings: Mapping[str, Recording], prefers_native: bool = False) -> CampaignContext:
    """Build the FMUs and design the controllers that all runs share.

    FMUs are machine code where that is preferred and a compiler works; rows are the same to rounding.

    Raises what building and design raise where the declared robot cannot follow a path.
    """
    if not plan.paths:
        return CampaignContext(plan, recordings)
    robot = robot_from_content(dict(plan.content), plan.file)
    reference_inputs = {
        variant: build_reference_input(robot, plan.paths[path], controller, plan.compute, recordings)
        for variant, (path, controller) in enumerate(plan.variants)
    }
    simulated = _simulated_robot(at_path_start(robot, plan.paths[0]), reference_inputs[0])
    bundle = build_bundle(simulated, prefers_native)
    differs_by_run = plan.belief == "varied" or any(key.startswith("platform.start") for key in plan.keys)
    return CampaignContext(plan, recordings, bundle, {} if differs_by_run else reference_inputs)


def run_job(context: CampaignContext, job: Job, fmu_folder: Path) -> RunResult:
    """Simulate one run; its row has the outputs computed before a failure, and the reason of the failure.

    The row depends on the plan and the job alone. ``fmu_folder`` caches FMUs between runs.

    Raises OSError where the machine fails, not the run.
    """
    row = identifying_columns(context.plan, job)
    series: Series = {}
    try:
        for outputs, stage_series in _run_stages(context, job, fmu_folder):
            row |= outputs
            series = stage_series
    except OSError:
        raise
    except Exception as error:
        row[FAILURE_COLUMN] = failure_reason(error)
    return RunResult(row, series)


def identifying_columns(plan: Plan, job: Job) -> Row:
    """The columns of a row that say which run it is: indices, path, controller and inputs."""
    path, controller = plan.variants[job.variant]
    path_columns = {"path": plan.paths[path].name, "controller": controller} if path >= 0 else {}
    inputs = dict(zip(plan.keys, job.values, strict=True))
    return {"index": job.index, "sample": job.sample, **path_columns, **inputs}


def failure_reason(error: BaseException) -> str:
    """The text of an error on one line, for a row."""
    message = one_line(" ".join(str(error).split())) or "no message"
    return f"{type(error).__name__}: {message}"[:MAX_REASON_LENGTH]


def _run_stages(context: CampaignContext, job: Job, fmu_folder: Path) -> Iterable[tuple[Row, Series]]:
    plan = context.plan
    robot = robot_from_content(with_values(plan.content, dict(zip(plan.keys, job.values, strict=True))), plan.file)
    path_index, controller = plan.variants[job.variant]
    if path_index >= 0:
        robot = at_path_start(robot, plan.paths[path_index])
    if plan.compute.statics:
        yield {"held": False}, {}
        tensions = static_tensions(robot)
        yield (
            {"held": True} | {f"static_tension_{cable}": float(each) for cable, each in enumerate(tensions, start=1)},
            {},
        )
    if plan.compute.modes:
        yield _modal_outputs(robot, linearise(robot, swing=0.0)), {}
    if path_index >= 0 and context.bundle is not None:
        reference_input = context.reference_inputs.get(job.variant) or build_reference_input(
            _nominal_robot(robot, plan), plan.paths[path_index], controller, plan.compute, context.recordings
        )
        motion = _true_motion(robot, context.bundle, fmu_folder, reference_input, plan, job)
        yield _motion_outputs(robot, reference_input, motion), _resampled_series(motion, plan.compute.series)


def _nominal_robot(robot: Robot, plan: Plan) -> Robot:
    """The nominal robot, for which controllers and winch speeds are designed."""
    if plan.belief == "varied":
        return robot
    return with_start(robot_from_content(dict(plan.content), plan.file), robot.platform.start)


def _modal_outputs(robot: Robot, plant: LinearPlant) -> Row:
    """Natural frequencies, damping ratios, and the smallest eigenvalue of the stiffness at the platform."""
    modes, A, B = plant.modes, plant.system.A, plant.system.B
    indices, numbers = StateIndices(plant.degrees_of_freedom, robot.cable_count), mode_numbers(len(modes.shapes) > 3)
    stiffness = -np.linalg.solve(B[indices.twist, robot.cable_count :], A[indices.twist, indices.pose])
    if robot.platform.is_rigid_body:
        # Against a force at the origin of the platform's frame, free to turn.
        stiffness = np.linalg.inv(np.linalg.inv(stiffness)[:3, :3])
    min_stiffness = float(np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0])
    frequencies = {f"frequency_{mode}": float(modes.frequencies[mode - 1]) for mode in numbers}
    damping_ratios = {f"damping_ratio_{mode}": float(modes.damping_ratios[mode - 1]) for mode in numbers}
    return {**frequencies, **damping_ratios, "stiffness_least": min_stiffness}


def _true_motion(
    robot: Robot, bundle: FmuBundle, fmu_folder: Path, reference_input: ReferenceInput, plan: Plan, job: Job
) -> CosimulationResult:
    """The motion of a run, not as its sensors show it."""
    simulated = _simulated_robot(robot, reference_input)
    fmus = cached_fmus(simulated, bundle, fmu_folder)
    return without_gains_and_offsets(simulated, fmus, _simulate(fmus, reference_input, plan, job))


def _simulated_robot(robot: Robot, reference_input: ReferenceInput) -> Robot:
    """The robot without sensor effects, unless a controller feeds back what they show."""
    design = reference_input.design
    return robot if design is not None and design.uses_feedback else without_sensor_effects(robot)


def _simulate(fmus: RobotFmus, reference_input: ReferenceInput, plan: Plan, job: Job) -> CosimulationResult:
    if reference_input.winch_speeds is not None:
        return cosimulate(fmus, reference_input.time, reference_input.winch_speeds, plan.compute.step)
    if reference_input.design is None or reference_input.trajectory is None:
        raise ValueError("an input without winch speeds needs a controller and its path")
    seed = int(np.random.SeedSequence((plan.seed, job.index)).generate_state(1)[0]) if plan.compute.noise else None
    return cosimulate_closed_loop(
        fmus,
        reference_input.nominal_robot,
        reference_input.design,
        reference_input.trajectory,
        float(reference_input.time[-1]),
        ClosedLoopOptions(plan.compute.step, seed=seed, reference=reference_input.reference),
    )


def _motion_outputs(robot: Robot, reference_input: ReferenceInput, motion: CosimulationResult) -> Row:
    """Outputs of a motion: end pose, path error, and the range of tensions."""
    row: dict[str, Any] = {f"end_{axis}": float(each) for axis, each in zip(AXES, motion.position[-1], strict=True)}
    if motion.orientation is not None:
        parts = zip(ORIENTATION_COLUMNS, motion.orientation[-1].tolist(), strict=True)
        row |= {f"end_{part}": value for part, value in parts}
    if reference_input.desired_position is not None:
        row |= _error_outputs("path_error", np.linalg.norm(motion.position - reference_input.desired_position, axis=1))
    if motion.orientation is not None and reference_input.desired_orientation is not None:
        rotations = rotation_vectors_between(motion.orientation, reference_input.desired_orientation)
        row |= _error_outputs("path_error_angle", np.linalg.norm(rotations, axis=1))
    min_tension, max_tension = motion.tension.min(axis=0), motion.tension.max(axis=0)
    for cable in robot.cable_numbers:
        row |= {f"tension_{cable}_least": float(min_tension[cable - 1])}
        row |= {f"tension_{cable}_largest": float(max_tension[cable - 1])}
    row["slack"] = bool(np.any(min_tension <= slack_tensions(robot)))
    if robot.tension is not None:
        row["limit_broken"] = bool(
            min_tension.min() < robot.tension.minimum or max_tension.max() > robot.tension.maximum
        )
    return row


def _error_outputs(prefix: str, errors: Array) -> Row:
    """Error at the end, largest error, and root mean square, over time."""
    values = {"end": errors[-1], "largest": errors.max(), "rms": np.sqrt(np.mean(errors**2))}
    return {f"{prefix}_{name}": float(value) for name, value in values.items()}


def _resampled_series(motion: CosimulationResult, point_count: int) -> Series:
    """Poses and tensions at evenly spaced times, from the start of a motion to its end."""
    if point_count < 2:
        return {}
    time = np.linspace(motion.time[0], motion.time[-1], point_count)
    is_rigid = motion.orientation is not None
    parts = [motion.position, *([] if motion.orientation is None else [motion.orientation]), motion.tension]
    outputs, names = np.hstack(parts), series_columns(motion.tension.shape[1], is_rigid)
    return {"time": time} | {
        name: np.interp(time, motion.time, column) for name, column in zip(names, outputs.T, strict=True)
    }
