"""The numbers that the page's figures draw, as one JSON value; the scripts in ``assets`` draw them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..tracer.verdict import Comparison, Trace
from .bands import Band, mode_bands, strange_bands
from .scene import Path, Scene, scene_data
from .series import envelope, envelope_times, noise_density, packed, spectrum, thinned
from .summary import Output, axis_outputs, cable_outputs
from .units import significant

Array = NDArray[np.float64]

ALL_POINTS = 260_000  # of all residuals on a page, so that it stays a few MB
MOST_POINTS, FEWEST_POINTS = 3000, 400  # a trace
PATH_POINTS = 900
MAGNIFICATIONS = (1, 10, 100, 1000)
# Deviations are drawn larger until the largest is this share of the robot, or that of the path's own size.
VISIBLE_SHARE, PATH_SHARE = 0.03, 0.15
ROLE_LABELS = {"fit": "Fit recording", "check": "Check recording"}


def page_data(trace: Trace) -> dict[str, Any]:
    """All recordings of a trace, ready to draw."""
    return {
        "anchors": [[float(value) for value in anchor] for anchor in trace.robot_before.anchors],
        "magnifications": list(MAGNIFICATIONS),
        "choices": [_recording(trace, comparison) for comparison in trace.comparisons],
    }


def outputs(trace: Trace) -> list[Output]:
    """All measured outputs in the order of a recording's: axes, then cables."""
    return [*axis_outputs(), *cable_outputs(trace.robot_before.cable_count)]


def noise_of(trace: Trace, output: Output) -> tuple[float, bool]:
    """Standard deviation of one sample in the output's unit, and whether the robot file declares it.

    Where it does not, it is the trace's noise floor of that output.
    """
    sensors = trace.robot_before.sensors
    declared = sensors.position_noise if output.key[0] == "axes" else sensors.tension_noise
    if declared is not None:
        return output.scale * declared, True
    return output.of(trace.noise_floor), False


def _recording(trace: Trace, comparison: Comparison) -> dict[str, Any]:
    shown = outputs(trace)
    points = int(np.clip(ALL_POINTS // (4 * len(shown)), FEWEST_POINTS, MOST_POINTS))
    return {
        "role": comparison.role,
        "label": ROLE_LABELS.get(comparison.role, comparison.role),
        "time": packed(envelope_times(comparison.recording.time, points)),
        "channels": [_channel(trace, comparison, output, place, points) for place, output in enumerate(shown)],
        "bands": [band.document() for band in bands_of(trace, comparison)],
        "scene": scene_data(_scene(trace, comparison)),
    }


def bands_of(trace: Trace, comparison: Comparison) -> list[Band]:
    """The modes of the extended model along a run, and what swings in that recording without being in the model."""
    seen = [each for each in trace.resonances if comparison.role in each.on]
    return [*mode_bands(trace.robot_after, comparison.after.position), *strange_bands(seen)]


def _channel(trace: Trace, comparison: Comparison, output: Output, place: int, points: int) -> dict[str, Any]:
    """Residuals of one output, measured minus model, and their spectra; null where it was not measured."""
    time = comparison.recording.time
    measured = comparison.recording.measured()[:, place]
    before = output.scale * (measured - comparison.before.measured()[:, place])
    after = output.scale * (measured - comparison.after.measured()[:, place])
    sigma, _ = noise_of(trace, output)
    described = {
        "label": output.label,
        "unit": output.unit,
        "rms": [significant(output.of(errors)) for errors in (comparison.errors_before, comparison.errors_after)],
        "sigma": sigma if math.isfinite(sigma) else None,
    }
    if not np.isfinite(before).any() and not np.isfinite(after).any():
        return {**described, "before": None, "after": None, "reach": None, "spectrum": None}
    return {
        **described,
        "before": packed(envelope(before, points)),
        "after": packed(envelope(after, points)),
        "reach": float(np.max(np.abs(after[np.isfinite(after)]), initial=0.0)),
        "spectrum": _spectrum(time, before, after, sigma),
    }


def _spectrum(time: Array, before: Array, after: Array, sigma: float) -> dict[str, Any] | None:
    found = spectrum(time, before, after)
    if found is None:
        return None
    return {
        "frequency": packed(found.frequency),
        "before": packed(found.before),
        "after": packed(found.after),
        "floor": noise_density(sigma, time) if math.isfinite(sigma) else None,
    }


def _scene(trace: Trace, comparison: Comparison) -> Scene:
    """The run of the extended model, and the paths of the declared one and of the recording beside it."""
    recording = comparison.recording
    kept = thinned(recording.time.size, PATH_POINTS)
    paths = [
        Path("before", comparison.before.position[kept], "before", 4),
        Path("after", comparison.after.position[kept], "accent", 5),
    ]
    if recording.has_position:
        paths.insert(0, Path("measured", recording.position[kept], "measured", 2, "dot"))
    return Scene(
        time=recording.time[kept],
        platform=comparison.after.position[kept],
        tension=comparison.after.tension[kept],
        paths=tuple(paths),
        measured_tension=recording.tension[kept] if recording.has_tension else None,
        magnify=_magnification(trace, comparison),
    )


def _magnification(trace: Trace, comparison: Comparison) -> int:
    """How many times larger to draw what the declared model and the recording have other than the extended one."""
    path = comparison.after.position
    apart = [comparison.before.position - path]
    if comparison.recording.has_position:
        apart.append(comparison.recording.position - path)
    return magnification(np.array(trace.robot_before.anchors), path, apart)


def magnification(anchors: Array, path: Array, apart: Sequence[Array]) -> int:
    """How many times larger to draw deviations ``apart`` (N, 3) from a ``path`` (N, 3), to be seen beside ``anchors``.

    A robot at rest has no path that they could hide.
    """
    gaps = np.concatenate([np.linalg.norm(each, axis=1) for each in apart])
    largest = float(np.max(gaps[np.isfinite(gaps)], initial=0.0))
    known = path[np.isfinite(path).all(axis=1)]
    reach = VISIBLE_SHARE * float(np.max(np.ptp(np.vstack((anchors, known)), axis=0)))
    travelled = float(np.max(np.ptp(known, axis=0))) if len(known) else 0.0
    if travelled > largest:
        reach = min(reach, PATH_SHARE * travelled)
    return max((times for times in MAGNIFICATIONS if times * largest <= reach), default=1) if largest > 0.0 else 1
