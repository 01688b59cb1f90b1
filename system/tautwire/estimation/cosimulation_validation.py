"""Validation of a robot by co-simulating its FMUs beside the recordings: errors before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.mathematics import REAL

from ..cosimulation import Experiment
from ..cosimulation.recording_simulation import recorded_input
from ..cosimulation.robot_cosimulation import (
    DEFAULT_STEP,
    CosimulationResult,
    run_cosimulation,
    step_size_control_for,
)
from ..fmus.packaging import build_fastest_fmus
from ..recordings.quaternion_columns import rotation_vectors
from ..recordings.recording import Recording
from ..robot.active_effects import platform_effects
from ..robot.schema import Robot
from .estimation_data import DataSet
from .measured_outputs import Outputs, measured_outputs, orientations, output_residuals
from .parameter_fit import Fitter
from .policy import DEFAULT_POLICY, CosimulationPolicy
from .smoothed_states import calibrate, with_initial_state
from .trace_result import Comparison, Errors
from .worker_pool import PendingResult, WorkerPool

Array = NDArray[np.float64]

ROLES = ("fit", "check")


def start_cosimulations(
    workers: WorkerPool, fitter: Fitter, robot: Robot, data_sets: Sequence[DataSet]
) -> list[PendingResult[CosimulationResult]]:
    """Start the co-simulations of a robot over some recordings, each from its smoothed initial state."""
    return [
        workers.submit(cosimulate_data_set, with_initial_state(fitter, robot, sample), sample) for sample in data_sets
    ]


def cosimulate_data_set(robot: Robot, data: DataSet) -> CosimulationResult:
    """Co-simulate a robot placed where a recording starts."""
    with TemporaryDirectory(prefix="tautwire-trace-") as folder:
        fmus = build_fastest_fmus(robot.as_modelled(), Path(folder))
        fmus = replace(fmus, relative_tolerance=DEFAULT_POLICY.cosimulation.relative_tolerance)
        time = data.recording.time
        experiment = Experiment(recorded_input(data.recording), time, step_size_control_for(DEFAULT_STEP, None, time))
        return as_tracked(robot, run_cosimulation(fmus, experiment))


def as_tracked(robot: Robot, motion: CosimulationResult) -> CosimulationResult:
    """A motion whose orientation is as late as the tracker shows it; the platform's FMU delays the position alone."""
    delay = float(stages.sensor_delays(REAL, platform_effects(robot))[1])
    if motion.orientation is None or delay == 0.0:
        return motion
    begin, time = motion.orientation[0].tolist(), motion.time
    columns = rotation_vectors(motion.orientation, begin).T
    shown = np.array([np.interp(time - delay, time, column) for column in columns]).T
    return replace(motion, orientation=orientations(shown, begin))


def validate_by_cosimulation(
    identified: Robot,
    fitter: Fitter,
    data_sets: Sequence[DataSet],
    runs_before: Sequence[CosimulationResult],
    workers: WorkerPool,
    policy: CosimulationPolicy,
) -> tuple[tuple[Comparison, ...], list[Errors]] | None:
    """Errors that the co-simulation of a better robot leaves; None where they are more than noise.

    It has the last word: a filter follows what the model itself would not do.
    """
    runs_after = [run.result() for run in start_cosimulations(workers, fitter, identified, data_sets)]
    comparisons, noise_floors = compare_cosimulations(identified, fitter, data_sets, runs_before, runs_after)
    limits = [largest_chance_errors(fitter, identified, sample, policy) for sample in data_sets]
    all_near_floor = all(
        is_near_noise_floor(c.errors_after, limit) for c, limit in zip(comparisons, limits, strict=True)
    )
    return (comparisons, noise_floors) if all_near_floor else None


def compare_cosimulations(
    robot: Robot,
    fitter: Fitter,
    data_sets: Sequence[DataSet],
    runs_before: Sequence[CosimulationResult],
    runs_after: Sequence[CosimulationResult],
) -> tuple[tuple[Comparison, ...], list[Errors]]:
    """Compare both runs with each recording, and with the noise floor under the later robot.

    Recordings are corrected for the constant errors that their sensors may have, as far as those are stated.
    """
    recordings = [calibrate(fitter, robot, sample).without_sensor_errors(sample.recording) for sample in data_sets]
    comparisons = tuple(
        Comparison(role, recording, b, a, output_errors(recording, b), output_errors(recording, a))
        for role, recording, b, a in zip(ROLES, recordings, runs_before, runs_after, strict=False)
    )
    return comparisons, [noise_floor(fitter, robot, sample) for sample in data_sets]


def output_errors(recording: Recording, outputs: Outputs) -> Errors:
    """Root-mean-square errors: measured less simulated."""
    return _root_mean_squares(output_residuals(recording, outputs) ** 2, recording.cable_count)


def noise_floor(fitter: Fitter, robot: Robot, data: DataSet) -> Errors:
    """Noise floor: the errors that noise of the sensors and winch speeds alone would leave in a simulation."""
    return _errors_of_noise(fitter, robot, data, white_ratio=1.0, drift_ratio=1.0)


def largest_chance_errors(fitter: Fitter, robot: Robot, data: DataSet, policy: CosimulationPolicy) -> Errors:
    """Largest errors that noise leaves in a simulation by chance: white noise hardly varies, a random walk does.

    Ropes whose recorded speeds have noise drift as one; all of a robot's tensions may hang on one such walk.
    """
    return _errors_of_noise(fitter, robot, data, policy.max_error_ratio, policy.max_drift_ratio)


def _errors_of_noise(fitter: Fitter, robot: Robot, data: DataSet, white_ratio: float, drift_ratio: float) -> Errors:
    """Errors at these ratios to those that white noise of sensors, and what noisy speeds make drift, are to leave."""
    variances = fitter.open_loop_variances(robot, data)
    white = np.minimum(fitter.noise.white_variances(robot.cable_count), variances)
    squares = white_ratio**2 * white + drift_ratio**2 * (variances - white)
    measured = measured_outputs(data.recording, robot.platform.is_rigid_body)
    return _root_mean_squares(np.where(np.isfinite(measured), squares, np.nan), robot.cable_count)


def is_near_noise_floor(after: Errors, of_noise: Errors, max_ratio: float = 1.0) -> bool:
    """Whether the errors of a co-simulation are at most a multiple of those of noise."""
    pairs = zip(after.by_kind, of_noise.by_kind, strict=True)
    return all(not error > max_ratio * least for error, least in pairs)


def _root_mean_squares(squares: Array, cable_count: int) -> Errors:
    """Errors from squares (N, m) of the outputs' errors."""
    positions, tensions, rotations = np.split(squares, [3, 3 + cable_count], axis=1)
    return Errors(
        position_rms=_root_mean(positions),
        tension_rms=_root_mean(tensions),
        axes=np.array([_root_mean(column) for column in positions.T]),
        cables=np.array([_root_mean(column) for column in tensions.T]),
        orientation_rms=_root_mean(rotations),
        rotations=np.array([_root_mean(column) for column in rotations.T]),
    )


def _root_mean(squares: Array) -> float:
    seen = squares[np.isfinite(squares)]
    return float(np.sqrt(np.mean(seen))) if seen.size else float("nan")
