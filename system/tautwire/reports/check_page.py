"""What ``check`` read of a robot file and a recording as one HTML page that needs no network, with its problems."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..number_format import format_percent, format_significant
from ..provenance import Provenance
from ..recordings.alternative_readings import WindingReading
from ..recordings.geometry_reading import GeometryReading
from ..recordings.motion_regression import LengthRegression, length_regression
from ..recordings.quaternion_columns import bridged_quaternions, rotation_vectors
from ..recordings.recording import Recording
from ..recordings.sensor_gaps import bridge_short_gaps, slower_rate
from ..recordings.weight_balance import ForceBalance, force_balance
from ..robot.schema import AXES, QUATERNION_COLUMNS, Robot
from .check_figures import CheckCurve, CheckPanel, panel_data, robot_scene
from .page_rendering import Number, PageHeader, Row, render_page
from .robot_scene import MAGNIFICATIONS, scene_data

Array = NDArray[np.float64]

MAX_REGULAR_STEP = 1.5  # median steps; a longer one is a gap


@dataclass(frozen=True)
class CheckedFiles:
    """What a check read and found; ``problems`` are triples of where, what, and what mends it.

    ``recording`` is None where none was read.
    """

    robot: Robot
    recording: Recording | None
    problems: tuple[tuple[str, str, str], ...]
    notes: tuple[str, ...]
    provenance: Provenance | None = None


def can_be_drawn(robot: Robot) -> bool:
    """Whether the exit points and the start of a robot, which may be invalid, are numbers."""
    return bool(robot.cables) and bool(np.isfinite(np.array([*robot.anchors, robot.platform.start], dtype=float)).all())


def check_page(checked: CheckedFiles, links: Mapping[str, str]) -> str:
    """The page of a check; ``links`` maps labels to paths beside the page, such as "robot.toml"."""
    robot, recording = checked.robot, checked.recording
    regression = balance = None
    if recording is not None:
        regression = length_regression(robot, recording)
        declared = WindingReading(signs=(1,) * robot.cable_count, order=tuple(range(robot.cable_count)))
        balance = force_balance(robot, recording, GeometryReading(), declared)
    groups = {
        "speeds": [] if recording is None else _speed_panels(recording),
        "lengths": [] if regression is None else _length_panels(regression),
        "orientation": [] if recording is None else _orientation_panels(recording),
        "tensions": [] if balance is None else _tension_panels(balance),
    }
    panels = [panel for group in groups.values() for panel in group]
    figures = {
        "anchors": [[float(value) for value in anchor] for anchor in robot.anchors],
        "magnifications": list(MAGNIFICATIONS),
        "choices": [
            {"label": "Check", "channels": panel_data(panels), "scene": scene_data(robot_scene(robot, recording))}
        ],
    }
    return render_page(
        "check",
        _header(checked, links),
        figures,
        robot=robot,
        recording=recording,
        remark="" if recording is None else _sampling_text(recording),
        problems=checked.problems,
        panels={name: [(panels.index(panel), panel.label) for panel in group] for name, group in groups.items()},
        length_rows=[] if regression is None else _length_rows(regression),
        tension_rows=[] if balance is None else _tension_rows(balance),
        balance="" if balance is None else _balance_text(balance),
        columns=[] if recording is None else _column_rows(recording),
        sampling="" if recording is None else _reading_text(recording, checked.notes),
        notes=checked.notes,
    )


def _header(checked: CheckedFiles, links: Mapping[str, str]) -> PageHeader:
    count, robot = len(checked.problems), checked.robot
    verdict = f"{count} problem{'' if count == 1 else 's'}" if count else "No problems found"
    headline = f"{robot.name}: {verdict[0].lower()}{verdict[1:]}."
    subject = f"{robot.name}, {robot.cable_count} cables"
    kind = "unexplained" if count else "none"
    return PageHeader("Tautwire check", subject, headline, headline, verdict, kind, links, checked.provenance)


def _speed_panels(recording: Recording) -> list[CheckPanel]:
    return [
        CheckPanel(
            "Winch speed",
            f"cable {cable}",
            "m/s",
            "Time (s)",
            (CheckCurve("recorded", recording.time, speed),),
            f"rms {format_significant(_rms(speed))} m/s",
        )
        for cable, speed in enumerate(recording.winch_speed.T, 1)
    ]


def _length_panels(regression: LengthRegression) -> list[CheckPanel]:
    panels = []
    for cable, (lengths, wound) in enumerate(zip(regression.lengths.T, regression.wound.T, strict=True), 1):
        travel, shortening = 1e3 * wound, -1e3 * lengths
        curves = (CheckCurve("reeled in", travel, travel, True), CheckCurve("by the positions", travel, shortening))
        numbers = f"slope {format_significant(regression.slopes[cable - 1])}"
        panels.append(CheckPanel("Shortening", f"cable {cable}", "mm", "Reeled in (mm)", curves, numbers))
    return panels


def _orientation_panels(recording: Recording) -> list[CheckPanel]:
    if not recording.has_orientation:
        return []
    vectors = 1e3 * rotation_vectors(bridged_quaternions(recording.time, recording.orientation))
    is_measured = np.isfinite(recording.orientation).all(axis=1)
    return [
        CheckPanel(
            "Rotation",
            f"about {axis}",
            "mrad",
            "Time (s)",
            (CheckCurve("recorded", recording.time, angles),),
            f"rms {format_significant(_rms(angles[is_measured]))} mrad",
        )
        for axis, angles in zip(AXES, vectors.T, strict=True)
    ]


def _tension_panels(balance: ForceBalance) -> list[CheckPanel]:
    panels, balanced = [], balance.balanced_tensions()
    for cable, has_load_cell in enumerate(balance.has_load_cell):
        if has_load_cell:
            measured = balance.tensions[:, cable]
            curves = (
                CheckCurve("measured", balance.time, measured, True),
                CheckCurve("balanced", balance.time, balanced[:, cable]),
            )
            numbers = f"rms difference {format_significant(_rms(measured - balanced[:, cable]))} N"
            panels.append(CheckPanel("Tension", f"cable {cable + 1}", "N", "Time (s)", curves, numbers))
    return panels


def _length_rows(regression: LengthRegression) -> list[Row]:
    return [
        [f"Cable {cable}", Number(format_significant(float(slope), 4)), Number(format_percent(float(misfit)))]
        for cable, (slope, misfit) in enumerate(zip(regression.slopes, regression.misfits, strict=True), 1)
    ]


def _tension_rows(balance: ForceBalance) -> list[Row]:
    balanced = balance.balanced_tensions()
    return [
        [
            f"Cable {cable + 1}",
            Number(format_significant(float(balance.tensions[:, cable].mean()), 4), "N"),
            Number(format_significant(float(balanced[:, cable].mean()), 4), "N"),
            Number(format_significant(_rms(balance.tensions[:, cable] - balanced[:, cable])), "N"),
        ]
        for cable, has_load_cell in enumerate(balance.has_load_cell)
        if has_load_cell
    ]


def _balance_text(balance: ForceBalance) -> str:
    declared = tuple(range(len(balance.has_load_cell)))
    return (
        f"The tensions carry {format_percent(balance.carried(declared))} of weight and inertia and leave "
        f"{format_percent(balance.misfit(declared))} unbalanced{', moments included' if balance.has_moments else ''}."
    )


def _column_rows(recording: Recording) -> list[Row]:
    """The range of each column in SI units, its rate, and the share of its samples that are missing.

    A rope whose length was recorded has that in place of its speed, which is computed.
    """
    units = (
        {"time": "s", "winch": "m/s", "rope": "m", "tension": "N"}
        | dict.fromkeys(AXES, "m")
        | dict.fromkeys(QUATERNION_COLUMNS, "1")
    )
    rate = 1.0 / float(np.median(np.diff(recording.time)))
    rows: list[Row] = []
    for name, values in _recorded_columns(recording).items():
        finite = values[np.isfinite(values)]
        ends = (float(finite.min()), float(finite.max())) if finite.size else (None, None)
        own_rate = slower_rate(recording.time, values)
        samples = values if own_rate is None else bridge_short_gaps(recording.time, values)
        shown_rate = format_significant((own_rate or rate) if finite.size else None)
        rows.append(
            [
                name,
                units[name.split("_", maxsplit=1)[0]],
                *(Number(format_significant(end, 4)) for end in ends),
                Number(shown_rate, "Hz" if finite.size else ""),
                Number(format_percent(1.0 - float(np.isfinite(samples).mean()))),
            ]
        )
    return rows


def _recorded_columns(recording: Recording) -> dict[str, Array]:
    """The columns of a recording by name, each (N,), with the rope lengths that were recorded."""
    columns: dict[str, Array] = {}
    for name, values in recording.frame().items():
        kind, _, number = str(name).rpartition("_")
        if kind == "winch_speed" and recording.rope_length is not None and int(number) in recording.rope_lengths:
            columns[f"rope_length_{number}"] = recording.rope_length[:, int(number) - 1]
        else:
            columns[str(name)] = values.to_numpy()
    return columns


def _sampling_text(recording: Recording) -> str:
    steps = np.diff(recording.time)
    median_step = float(np.median(steps))
    long_steps = steps[steps > MAX_REGULAR_STEP * median_step]
    longest = f", the longest of {format_significant(float(long_steps.max()))} s" if long_steps.size else ""
    return (
        f"{recording.sample_count} samples over {format_significant(recording.duration)} s, at "
        f"{format_significant(1.0 / median_step)} Hz; steps longer than {MAX_REGULAR_STEP:g} of the median: "
        f"{long_steps.size}{longest}."
    )


def _reading_text(recording: Recording, notes: tuple[str, ...]) -> str:
    """Sampling, and what the notes do not say already of how the recording was read."""
    unsaid = "".join(f" {note}." for note in recording.notes if note not in notes)
    return f"{_sampling_text(recording)} Ranges are in the units stated.{unsaid}"


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
