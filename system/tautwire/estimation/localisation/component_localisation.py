"""Localisation of model error: each FMU alone at its measured ports, before any effect is fitted.

A cable FMU along the measured path with the recorded winch speed gives a tension, to be compared with its load cell;
the platform FMU under the measured tensions gives an acceleration, to be compared with the measured path. A wrong rope
or winch shows at its cable alone, since the measured tension is real; a wrong weight or an external force at the
platform alone; a wrong load cell at both, and the balance closes with the FMU's tension instead; a wrong exit point at
both, and it does not close. The initial tension of each cable is free: it follows from the platform's weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ...fmus.packaging import RobotFmus, build_fmus
from ...recordings.recording import Recording
from ...recordings.start_position import with_start
from ...robot.schema import Robot
from ..estimation_data import DataSet
from ..kalman_filter import Noise
from .cable_simulation import CableSimulation, exit_shift, simulate_cable
from .component_residuals import ComponentResidual, FaultLocalisation, root_mean_square
from .fault_isolation import isolation_verdict, numbered
from .force_balance import ForceBalance, force_balance, measured_forces, simulate_platform
from .path_smoothing import MIN_MEASURED_SAMPLES, SmoothedPath, smooth_path
from .residual_evaluation import cable_residual, platform_residual

Array = NDArray[np.float64]

# Samples that are evaluated: the cost grows with them, and these are enough.
MAX_SAMPLES = 20_000
MAX_CLOSURE_RATIO = 0.5
PLANARITY_TOLERANCE = 1e-6


def localise_residual(robot: Robot, sample: DataSet, noise: Noise) -> FaultLocalisation:
    """Localise the model error of a robot by running each FMU alone along a recording; raises ComponentError."""
    recording = sample.recording.first(MAX_SAMPLES)
    limitations = list(_limitations(robot, recording))
    if recording.sample_count < sample.recording.sample_count:
        limitations.append(f"only the first {recording.duration:.4g} s were analysed")
    if not _has_path(robot, recording):
        return FaultLocalisation(recording.time, (), *isolation_verdict((), ()), tuple(limitations))
    robot_at_start = with_start(robot.as_modelled(), sample.start)
    path = smooth_path(recording, robot_at_start.platform.start, noise.of_outputs(robot.cable_count)[:3])
    with TemporaryDirectory(prefix="tautwire-cut-") as folder:
        return _evaluate_components(
            robot_at_start, build_fmus(robot_at_start, FilePath(folder)), recording, path, noise, limitations
        )


def _evaluate_components(
    robot: Robot, fmus: RobotFmus, recording: Recording, path: SmoothedPath, noise: Noise, limitations: list[str]
) -> FaultLocalisation:
    columns = recording.winch_speed.T
    runs = [
        simulate_cable(f"cable_{i}", fmu, path, speed)
        for i, fmu, speed in zip(robot.cable_numbers, fmus.cables, columns, strict=True)
    ]
    has_tension = np.sum(np.isfinite(recording.tension), axis=0) >= MIN_MEASURED_SAMPLES
    cable_residuals = [
        cable_residual(number, run, recording, path, noise, np.array(robot.cables[number - 1].anchor))
        for number, run, is_measured in zip(robot.cable_numbers, runs, has_tension, strict=True)
        if is_measured
    ]
    if not np.all(has_tension):
        return FaultLocalisation(
            path.time, tuple(cable_residuals), *isolation_verdict(cable_residuals, ()), tuple(limitations)
        )

    sigmas = noise.of_outputs(robot.cable_count)

    def balance_under(tension: Array) -> ForceBalance:
        forces = measured_forces(runs, tension, np.array(robot.anchors), path.position)
        accelerations = simulate_platform(fmus.platform, path, forces, robot.platform.mass)
        return force_balance(path, recording.position, accelerations, forces, robot.platform.mass, sigmas)

    measured_balance = balance_under(recording.tension)
    measured_axes = np.flatnonzero(np.any(np.isfinite(measured_balance.force), axis=0))
    platform_residuals = [platform_residual(int(axis), measured_balance, path) for axis in measured_axes]
    is_deviating = [cable.is_significant for cable in cable_residuals]
    balance_closes = False
    if any(is_deviating) and any(part.is_significant for part in platform_residuals):
        simulated_tension = np.column_stack([run.tension for run in runs])
        balance_closes = _is_balance_closed(
            balance_under(np.where(is_deviating, simulated_tension, recording.tension)).force, measured_balance.force
        )
    exit_candidates = [
        number
        for number, cable, run in zip(robot.cable_numbers, cable_residuals, runs, strict=True)
        if platform_residuals and cable.is_significant and _may_be_exit_point(cable, run, platform_residuals)
    ]
    residuals = (*cable_residuals, *platform_residuals)
    return FaultLocalisation(
        path.time,
        residuals,
        *isolation_verdict(cable_residuals, platform_residuals, balance_closes, exit_candidates),
        tuple(limitations),
    )


def _is_balance_closed(swapped: Array, force: Array) -> bool:
    """Whether swapped tensions close the balance: the missing force, and its variation, become less than half."""
    centred = [values - np.nanmean(values, axis=0) for values in (swapped, force)]
    pairs = ((swapped, force), (centred[0], centred[1]))
    return all(root_mean_square(after) < MAX_CLOSURE_RATIO * root_mean_square(before) for after, before in pairs)


def _may_be_exit_point(cable: ComponentResidual, run: CableSimulation, platform: Sequence[ComponentResidual]) -> bool:
    """Whether a shift of the exit point too small to show in the platform's balance explains a cable's residual."""
    detectable_force = min(part.threshold * part.expected_rms for part in platform)
    max_shift = detectable_force * float(np.min(run.length)) / float(np.max(run.tension))
    _, remaining = exit_shift(run, cable.residual, cable.expected_rms, max_shift)
    return root_mean_square(remaining) < cable.threshold * cable.expected_rms


def _has_path(robot: Robot, recording: Recording) -> bool:
    """Whether positions determine the path: along all axes, but for one across which the robot is planar."""
    points = np.array([*robot.anchors, robot.platform.start])
    flat = np.ptp(points, axis=0) <= PLANARITY_TOLERANCE * np.max(np.ptp(points, axis=0))
    measured = np.sum(np.isfinite(recording.position), axis=0) >= MIN_MEASURED_SAMPLES
    return bool(np.all(measured | flat) and np.any(measured))


def _limitations(robot: Robot, recording: Recording) -> list[str]:
    """Limitations of a recording, in words."""
    if not _has_path(robot, recording):
        return ["positions are missing: neither the cables nor the platform can be simulated alone"]
    unmeasured = [
        n for n in robot.cable_numbers if np.sum(np.isfinite(recording.tension[:, n - 1])) < MIN_MEASURED_SAMPLES
    ]
    if not unmeasured:
        return []
    if len(unmeasured) == robot.cable_count:
        return ["no tensions: neither the cables nor the platform can be simulated alone"]
    return [f"no tension of {numbered('cable', unmeasured)}: neither that nor the platform can be simulated alone"]
