"""The data of the figures on a trace's page, as one JSON value; the scripts in ``assets`` draw them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..estimation.measured_outputs import output_residuals
from ..estimation.trace_result import Comparison, Trace
from ..number_format import format_significant
from ..recordings.sensor_gaps import bridge_short_gaps
from .downsampling import (
    envelope_times,
    min_max_envelope,
    pack_float32,
    residual_spectra,
    white_noise_density,
)
from .mode_bands import Band, mode_bands, resonance_bands
from .robot_scene import (
    MAGNIFICATIONS,
    RobotScene,
    ScenePath,
    body_attachments,
    deviation_magnification,
    fill_unmeasured,
    frame_indices,
    measured_path,
    scene_data,
)
from .trace_texts import MeasuredOutput, output_groups

Array = NDArray[np.float64]

MAX_RESIDUAL_POINTS = 40_000  # in all residual curves of a page, which so weighs at most 1.5 MB
MAX_CURVE_POINTS, MIN_CURVE_POINTS = 3000, 400  # per curve
ROLE_LABELS = {"fit": "Fit recording", "check": "Check recording"}


def trace_page_data(trace: Trace) -> dict[str, Any]:
    """The figure data of all recordings of a trace."""
    return {
        "anchors": [[float(value) for value in anchor] for anchor in trace.robot_before.anchors],
        "magnifications": list(MAGNIFICATIONS),
        "choices": [_recording_data(trace, comparison) for comparison in trace.comparisons],
    }


def measured_outputs(trace: Trace) -> list[MeasuredOutput]:
    """All measured outputs in the order of the residuals: axes, cables, then rotations."""
    return [output for _, parts in output_groups(trace.robot_before) for output in parts]


def noise_deviation(trace: Trace, output: MeasuredOutput) -> tuple[float, bool]:
    """Standard deviation of an output's measurement noise in its unit, and whether the robot file declares it.

    Where it does not, the trace's noise floor of that output is returned.
    """
    sensors = trace.robot_before.sensors
    by_field = {"axes": sensors.position_noise, "cables": sensors.tension_noise, "rotations": sensors.orientation_noise}
    declared = by_field[output.errors_key[0]]
    if declared is not None:
        return output.scale * declared, True
    return output.error_of(trace.noise_floor), False


def _recording_data(trace: Trace, comparison: Comparison) -> dict[str, Any]:
    page_outputs = measured_outputs(trace)
    points = int(np.clip(MAX_RESIDUAL_POINTS // (4 * len(page_outputs)), MIN_CURVE_POINTS, MAX_CURVE_POINTS))
    return {
        "role": comparison.role,
        "label": ROLE_LABELS.get(comparison.role, comparison.role),
        "time": pack_float32(envelope_times(comparison.recording.time, points)),
        "channels": [
            _channel_data(trace, comparison, output, index, points) for index, output in enumerate(page_outputs)
        ],
        "bands": [band.document() for band in spectrum_bands(trace, comparison)],
        "scene": scene_data(_trace_scene(trace, comparison)),
    }


def spectrum_bands(trace: Trace, comparison: Comparison) -> list[Band]:
    """Bands of the extended model's modes along a run, and of resonances in that recording that the model lacks."""
    resonances = [each for each in trace.resonances if comparison.role in each.on]
    after = comparison.after
    return [*mode_bands(trace.robot_after, after.position, after.orientation), *resonance_bands(resonances)]


def _channel_data(
    trace: Trace, comparison: Comparison, output: MeasuredOutput, index: int, points: int
) -> dict[str, Any]:
    """Residuals of one output, measured minus model, and their spectra; None where it was not measured."""
    time = comparison.recording.time
    before, after = (
        output.scale * output_residuals(comparison.recording, run)[:, index]
        for run in (comparison.before, comparison.after)
    )
    sigma, _ = noise_deviation(trace, output)
    description = {
        "label": output.label,
        "unit": output.unit,
        "rms": [
            format_significant(output.error_of(errors))
            for errors in (comparison.errors_before, comparison.errors_after)
        ],
        "sigma": sigma if math.isfinite(sigma) else None,
    }
    if not np.isfinite(before).any() and not np.isfinite(after).any():
        return {**description, "before": None, "after": None, "reach": None, "spectrum": None}
    return {
        **description,
        "before": pack_float32(min_max_envelope(bridge_short_gaps(time, before), points)),
        "after": pack_float32(min_max_envelope(bridge_short_gaps(time, after), points)),
        "reach": float(np.max(np.abs(after[np.isfinite(after)]), initial=0.0)),
        "spectrum": _spectrum_data(time, before, after, sigma),
    }


def _spectrum_data(time: Array, before: Array, after: Array, sigma: float) -> dict[str, Any] | None:
    spectra = residual_spectra(time, before, after)
    if spectra is None:
        return None
    return {
        "frequency": pack_float32(spectra.frequency),
        "before": pack_float32(spectra.before),
        "after": pack_float32(spectra.after),
        "floor": white_noise_density(sigma, time[np.isfinite(after)]) if math.isfinite(sigma) else None,
    }


def _trace_scene(trace: Trace, comparison: Comparison) -> RobotScene:
    """The scene of the extended model's run, with the paths of the declared model and of the recording."""
    recording, robot, orientation = comparison.recording, trace.robot_after, comparison.after.orientation
    indices = frame_indices(recording.time.size, 3, robot.cable_count, robot.platform.is_rigid_body)
    platform = comparison.after.position[indices]
    paths = [
        ScenePath("before", comparison.before.position[indices], "before", 4),
        ScenePath("after", platform, "accent", 5),
    ]
    if recording.has_position:
        measured = measured_path(recording.time, recording.position, comparison.after.position)
        paths.insert(0, ScenePath("measured", measured[indices], "measured", 2, "dot"))
    return RobotScene(
        time=recording.time[indices],
        platform=platform,
        tension=comparison.after.tension[indices],
        paths=tuple(paths),
        measured_tension=recording.tension[indices] if recording.has_tension else None,
        magnification=_trace_magnification(trace, comparison),
        attachments=body_attachments(robot, platform, None if orientation is None else orientation[indices]),
    )


def _trace_magnification(trace: Trace, comparison: Comparison) -> int:
    """Magnification of the deviations of the declared model and the recording from the extended model."""
    path = comparison.after.position
    deviations = [comparison.before.position - path]
    if comparison.recording.has_position:
        deviations.append(fill_unmeasured(comparison.recording.position, path) - path)
    return deviation_magnification(np.array(trace.robot_before.anchors), path, deviations)
