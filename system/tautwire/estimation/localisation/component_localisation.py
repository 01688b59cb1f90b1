"""Localisation of model error: each FMU alone at its measured ports, before any effect is fitted.

A cable FMU along the measured path with the recorded winch speed gives a tension, to be compared with its load cell;
the platform FMU under the measured tensions gives an acceleration, to be compared with the measured path. A wrong rope
or winch shows at its cable alone, since the measured tension is real; a wrong weight or an external force at the
platform alone; a wrong load cell at both, and the balance closes with the FMU's tension instead; a wrong exit point at
both, and it does not close. The initial tension of each cable is free: it follows from the platform's weight. A load
cell's zero therefore shows at the platform alone, as a force along that cable.
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
from ...robot.schema import AXES, Robot
from ..estimation_data import DataSet
from ..kalman_filter import Noise
from ..policy import DEFAULT_POLICY
from .cable_simulation import CableSimulation, exit_shift, simulate_cable
from .component_residuals import PLATFORM, ComponentResidual, FaultLocalisation, root_mean_square
from .fault_isolation import isolation_verdict, numbered
from .force_balance import ForceBalance, force_balance, measured_forces, offset_candidates, simulate_platform
from .path_smoothing import MIN_MEASURED_SAMPLES, smooth_path
from .policy import LocalisationPolicy
from .residual_evaluation import MeasuredPorts, cable_residual, platform_residual

Array = NDArray[np.float64]

PLANARITY_TOLERANCE = 1e-6


def localise_residual(
    robot: Robot, sample: DataSet, noise: Noise, policy: LocalisationPolicy = DEFAULT_POLICY.localisation
) -> FaultLocalisation:
    """Localise the model error of a robot by running each FMU alone along a recording; raises ComponentError."""
    recording = sample.recording.first(policy.max_samples)
    limitations = _limitations(robot, recording)
    if recording.sample_count < sample.recording.sample_count:
        limitations.append(f"only the first {recording.duration:.4g} s were analysed")
    if robot.platform.is_rigid_body or not _has_path(robot, recording):
        return FaultLocalisation(recording.time, (), *isolation_verdict((), ()), tuple(limitations))
    robot_at_start = with_start(robot.as_modelled(), sample.start)
    path = smooth_path(recording, robot_at_start.platform.start, noise.of_outputs(robot.cable_count)[:3])
    measured = MeasuredPorts(robot_at_start, recording, path, noise)
    with TemporaryDirectory(prefix="tautwire-cut-") as folder:
        fmus = build_fmus(robot_at_start, FilePath(folder))
        return _evaluate_components(measured, fmus, tuple(limitations), policy)


def _evaluate_components(
    measured: MeasuredPorts, fmus: RobotFmus, limitations: tuple[str, ...], policy: LocalisationPolicy
) -> FaultLocalisation:
    """Residuals of the cables, then of the platform where all tensions are measured, and the verdict on both."""
    recording, path, numbers = measured.recording, measured.path, measured.robot.cable_numbers
    rates = [None] * len(numbers) if recording.winch_acceleration is None else recording.winch_acceleration.T
    runs = [
        simulate_cable(f"cable_{number}", fmu, path, speed, rate)
        for number, fmu, speed, rate in zip(numbers, fmus.cables, recording.winch_speed.T, rates, strict=True)
    ]
    has_tension = np.sum(np.isfinite(recording.tension), axis=0) >= MIN_MEASURED_SAMPLES
    cables = [
        cable_residual(measured, number, run, policy)
        for number, run, is_measured in zip(numbers, runs, has_tension, strict=True)
        if is_measured
    ]
    if not np.all(has_tension):
        return FaultLocalisation(path.time, tuple(cables), *isolation_verdict(cables, ()), limitations)
    balance = _balance_under(recording.tension, measured, fmus, runs)
    measured_axes = np.flatnonzero(np.any(np.isfinite(balance.force), axis=0))
    directions = measured_forces(runs, np.ones_like(recording.tension), np.array(measured.robot.anchors), path.position)
    platform = [platform_residual(measured, int(axis), balance, directions, policy) for axis in measured_axes]
    is_deviating = [cable.is_significant for cable in cables]
    balance_closes, candidates = False, []
    if any(axis.is_significant for axis in platform) and not any(is_deviating):
        candidates = offset_candidates(balance, directions, path, policy.max_closure_ratio)
        candidates = candidates or _load_cell_candidates(cables, platform, directions)
    elif any(axis.is_significant for axis in platform):
        simulated_tension = np.column_stack([run.tension for run in runs])
        mixed_tension = np.where(is_deviating, simulated_tension, recording.tension)
        force = _balance_under(mixed_tension, measured, fmus, runs).force
        balance_closes = _is_balance_closed(force, balance.force, policy.max_closure_ratio)
    exit_candidates = [
        number
        for number, cable, run in zip(numbers, cables, runs, strict=True)
        if platform and cable.is_significant and _may_be_exit_point(cable, run, platform)
    ]
    verdict = isolation_verdict(cables, platform, balance_closes, exit_candidates, candidates)
    return FaultLocalisation(path.time, (*cables, *platform), *verdict, limitations)


def _balance_under(
    tension: Array, measured: MeasuredPorts, fmus: RobotFmus, runs: Sequence[CableSimulation]
) -> ForceBalance:
    """Force balance of the platform FMU under some tensions (N, n)."""
    robot, path, mass = measured.robot, measured.path, measured.robot.platform.mass
    forces = measured_forces(runs, tension, np.array(robot.anchors), path.position)
    accelerations = simulate_platform(fmus.platform, path, forces, mass)
    sigmas = measured.noise.of_outputs(robot.cable_count)
    return force_balance(path, measured.recording.position, accelerations, forces, mass, sigmas)


def _is_balance_closed(mixed: Array, force: Array, max_ratio: float) -> bool:
    """Whether simulated tensions close the balance: the missing force, and its variation, become that much less."""
    centred = [_centred(values) for values in (mixed, force)]
    pairs = ((mixed, force), (centred[0], centred[1]))
    return all(root_mean_square(after) < max_ratio * root_mean_square(before) for after, before in pairs)


def _centred(values: Array) -> Array:
    """Values (N, k) without the mean of each column, NaN where one has none."""
    is_known = np.isfinite(values)
    sums, counts = np.sum(values, axis=0, where=is_known), np.maximum(is_known.sum(axis=0), 1)
    return np.asarray(values - sums / counts)


def _may_be_exit_point(cable: ComponentResidual, run: CableSimulation, platform: Sequence[ComponentResidual]) -> bool:
    """Whether a shift of the exit point too small to show in the platform's balance explains a cable's residual."""
    detectable_force = min(part.threshold * part.expected_rms for part in platform)
    max_shift = detectable_force * float(np.min(run.length)) / float(np.max(run.tension))
    _, remaining = exit_shift(run, cable.residual, cable.expected_rms, max_shift)
    return root_mean_square(remaining) < cable.threshold * cable.expected_rms


def _load_cell_candidates(
    cables: Sequence[ComponentResidual], platform: Sequence[ComponentResidual], directions: Array
) -> list[str]:
    """The platform and load cells that may err by the varying force that it misses, without standing out at a cable.

    Each that could alone, or else all together; ``directions`` (N, n, 3) are the cables'. None where that force hardly
    varies: it is a weight or a zero.
    """
    worst = max(platform, key=lambda part: part.ratio)
    variance = worst.rms**2 - worst.mean**2
    if variance <= worst.mean**2:
        return []
    axis = AXES.index(worst.quantity[-1])
    projections = np.sqrt(np.mean(directions[:, :, axis] ** 2, axis=0))
    limits = {
        part.cable_number: (part.threshold * part.expected_rms * float(projections[part.cable_number - 1])) ** 2
        for part in cables
    }
    if sum(limits.values()) < variance:
        return []
    numbers = [number for number, limit in limits.items() if limit >= variance] or list(limits)
    friction = "friction before it" if len(numbers) == 1 else "friction before them"
    return [PLATFORM, numbered("load cell", numbers), friction]


def _has_path(robot: Robot, recording: Recording) -> bool:
    """Whether positions determine the path: along all axes, but for one across which the robot is planar."""
    points = np.array([*robot.anchors, robot.platform.start])
    flat = np.ptp(points, axis=0) <= PLANARITY_TOLERANCE * np.max(np.ptp(points, axis=0))
    measured = np.sum(np.isfinite(recording.position), axis=0) >= MIN_MEASURED_SAMPLES
    return bool(np.all(measured | flat) and np.any(measured))


def _limitations(robot: Robot, recording: Recording) -> list[str]:
    """Limitations of a recording, in words."""
    if robot.platform.is_rigid_body:
        return ["components were not tested one by one: that is done for point masses only"]
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
