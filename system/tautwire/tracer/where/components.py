"""Where a robot errs: each FMU alone at its measured ports, before any effect is fitted.

A cable FMU along the measured path with the recorded winch speed shows a tension, which its load cell should show; the
platform FMU under the measured tensions shows an acceleration, which the measured path should have. A wrong rope or
winch shows at its cable alone, since the measured tension is real; a wrong weight or an outer force at the platform
alone; a wrong load cell at both, and the balance closes with the FMU's tension in its place; a wrong exit point at
both, and it does not. The start tension of each cable is free: it follows from what the platform weighs.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ...fmus.packaging import RobotFmus, build_fmus
from ...recordings.recording import Recording
from ...robots.robot import Robot
from ...runs.start import placed
from ..data import Sample
from ..filter_step import Noise
from .blame import named, verdict_of
from .cable_cut import CableRun, exit_shift, run_cable
from .path import FEWEST_SEEN, Path, smoothed_path
from .platform_cut import Balance, balance, measured_forces, run_platform
from .port_parts import axis_part, cable_part
from .port_residuals import ComponentResidual, Components, root_mean_square

Array = NDArray[np.float64]

# Samples that are looked at: the cost grows with them, and these tell.
MOST_SAMPLES = 20_000
CLOSED = 0.5
SAME_PLANE = 1e-6


def cut_at_ports(robot: Robot, sample: Sample, noise: Noise) -> Components:
    """Run each FMU of a robot alone along a recording; raises ComponentError where one fails."""
    recording = sample.recording.first(MOST_SAMPLES)
    untold = list(_missing(robot, recording))
    if recording.sample_count < sample.recording.sample_count:
        untold.append(f"only the first {recording.duration:.4g} s were looked at")
    if not _has_path(robot, recording):
        return Components(recording.time, (), *verdict_of((), ()), tuple(untold))
    here = placed(robot.as_modelled(), sample.start)
    path = smoothed_path(recording, here.platform.start, noise.of_outputs(robot.cable_count)[:3])
    with TemporaryDirectory(prefix="tautwire-cut-") as folder:
        return _cut(here, build_fmus(here, FilePath(folder)), recording, path, noise, untold)


def _cut(
    robot: Robot, fmus: RobotFmus, recording: Recording, path: Path, noise: Noise, untold: list[str]
) -> Components:
    columns = recording.winch_speed.T
    runs = [
        run_cable(f"cable_{i}", fmu, path, speed)
        for i, fmu, speed in zip(robot.cable_numbers, fmus.cables, columns, strict=True)
    ]
    measured = np.sum(np.isfinite(recording.tension), axis=0) >= FEWEST_SEEN
    cables = [
        cable_part(number, run, recording, path, noise, np.array(robot.cables[number - 1].anchor))
        for number, run, there in zip(robot.cable_numbers, runs, measured, strict=True)
        if there
    ]
    if not np.all(measured):
        return Components(path.time, tuple(cables), *verdict_of(cables, ()), tuple(untold))

    sigmas = noise.of_outputs(robot.cable_count)

    def balanced(tension: Array) -> Balance:
        forces = measured_forces(runs, tension, np.array(robot.anchors), path.position)
        shown = run_platform(fmus.platform, path, forces, robot.platform.mass)
        return balance(path, recording.position, shown, forces, robot.platform.mass, sigmas)

    found = balanced(recording.tension)
    looked_at = np.flatnonzero(np.any(np.isfinite(found.force), axis=0))
    platform = [axis_part(int(axis), found, path) for axis in looked_at]
    wrong = [cable.is_off for cable in cables]
    closes = False
    if any(wrong) and any(part.is_off for part in platform):
        shown = np.column_stack([run.tension for run in runs])
        closes = _closer(balanced(np.where(wrong, shown, recording.tension)).force, found.force)
    exits = [
        number
        for number, cable, run in zip(robot.cable_numbers, cables, runs, strict=True)
        if platform and cable.is_off and _may_be_exit(cable, run, platform)
    ]
    parts = (*cables, *platform)
    return Components(path.time, parts, *verdict_of(cables, platform, closes, exits), tuple(untold))


def _closer(swapped: Array, force: Array) -> bool:
    """Whether the balance closes by other tensions: the force that is missing, and how it moves, less than half."""
    moving = [values - np.nanmean(values, axis=0) for values in (swapped, force)]
    pairs = ((swapped, force), (moving[0], moving[1]))
    return all(root_mean_square(after) < CLOSED * root_mean_square(before) for after, before in pairs)


def _may_be_exit(cable: ComponentResidual, run: CableRun, platform: Sequence[ComponentResidual]) -> bool:
    """Whether a shift of the exit point that turns its pull by less than is seen explains a cable's residual."""
    seen = min(part.limit * part.expected_rms for part in platform)
    largest = seen * float(np.min(run.length)) / float(np.max(run.tension))
    _, left = exit_shift(run, cable.residual, cable.expected_rms, largest)
    return root_mean_square(left) < cable.limit * cable.expected_rms


def _has_path(robot: Robot, recording: Recording) -> bool:
    """Whether positions tell where the platform is: along all axes, but for one across which the robot is flat."""
    points = np.array([*robot.anchors, robot.platform.start])
    flat = np.ptp(points, axis=0) <= SAME_PLANE * np.max(np.ptp(points, axis=0))
    measured = np.sum(np.isfinite(recording.position), axis=0) >= FEWEST_SEEN
    return bool(np.all(measured | flat) and np.any(measured))


def _missing(robot: Robot, recording: Recording) -> list[str]:
    """What cannot be told of a recording, in words."""
    if not _has_path(robot, recording):
        return ["positions are missing: no cable and not the platform can be looked at alone"]
    without = [n for n in robot.cable_numbers if np.sum(np.isfinite(recording.tension[:, n - 1])) < FEWEST_SEEN]
    if not without:
        return []
    if len(without) == robot.cable_count:
        return ["no tensions: no cable and not the platform can be looked at alone"]
    return [f"no tension of {named('cable', without)}: neither that nor the platform can be looked at alone"]
