"""The paths of a plan, and the files that a plan names."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

from ..errors import format_value
from ..input_files import read_bytes
from ..recordings.recording import read_recording
from ..recordings.start_position import at_recorded_start
from ..robot.checked_table import CheckedTable
from ..robot.schema import Platform, Quaternion, Robot
from ..robot.trajectory import ANGLE_RULE, RADIUS_RULE, RISE_RULE
from ..robot.trajectory import DURATION_RULE as OF_PATH
from ..validation import NumberRule
from .campaign_plan import Input, PathPlan, PlanError

# Narrower than for one run: an error in a plan is repeated in many runs.
DURATION_RULE = OF_PATH._replace(minimum=1e-3, maximum=1e5)
UNTIL_RULE = NumberRule("where the recording is left", "s", 1e-3, 1e6)
HELIX_RULES = {
    "radius": RADIUS_RULE._replace(positive=True),
    "rise": RISE_RULE,
    "angle": ANGLE_RULE,
    "duration": DURATION_RULE,
}
ORIENTATION_KEYS = ("start_orientation", "end_orientation")


def file_relative_to_plan(table: CheckedTable, name: str | None) -> Path:
    """The absolute path of a file that a plan names relative to itself."""
    return (Path(table.file).parent / str(name)).absolute()


def file_digest(file: Path) -> str:
    """Digest of a file's content, or of the files in a bag's folder."""
    digest = hashlib.sha256()
    for each in sorted(file.iterdir()) if file.is_dir() else [file]:
        digest.update(read_bytes(each, PlanError))
    return digest.hexdigest()[:16]


def read_paths(table: CheckedTable, robot: Robot, inputs: tuple[Input, ...]) -> tuple[PathPlan, ...]:
    """Read all paths of a plan; names must be unique."""
    paths: list[PathPlan] = []
    for number, path_table in enumerate(table.tables("path") if "path" in table.content else (), start=1):
        path = read_path(path_table, f"path {number}", robot)
        if path.name in [each.name for each in paths]:
            path_table.refuse("name", f"is {format_value(path.name)} again", "give each path its own name")
        start_varies = any(each.key.startswith("platform.start") for each in inputs)
        if start_varies and (path.kind == "helix" or path.start is not None or path.start_orientation is not None):
            hint = "leave start out of a line, positions out of a recording"
            path_table.refuse("", "has a start of its own, but platform.start varies", hint)
        paths.append(path)
    return tuple(paths)


def read_path(table: CheckedTable, default: str, robot: Robot) -> PathPlan:
    """Read one path; ``default`` is its name where the table has none."""
    hint = 'give the path a name of one line, as in name = "up"'
    name = (table.text("name", hint) or "") if "name" in table.content else default
    if not name.strip() or not name.isprintable():
        table.refuse("name", f"is {format_value(name)}", hint)
    kind_keys = [key for key in ("end", "radius", "recording") if key in table.content]
    if len(kind_keys) != 1:
        hint = "give end and duration (a line), centre, radius, rise, angle and duration (a helix), or recording"
        table.refuse("", "is no path" if not kind_keys else f"has {' and '.join(kind_keys)}", hint)
    if kind_keys == ["end"]:
        table.require_known(("name", "start", "end", "duration", *ORIENTATION_KEYS))
        start = table.point("start", "where the line starts") if "start" in table.content else None
        end = table.point("end", "where the line ends")
        line = PathPlan(name, "line", {"duration": table.number("duration", DURATION_RULE)}, start, end)
        return _with_orientations(table, robot, line)
    if kind_keys == ["radius"]:
        table.require_known(("name", "centre", *HELIX_RULES, *ORIENTATION_KEYS))
        numbers = {key: table.number(key, rule) for key, rule in HELIX_RULES.items()}
        helix = PathPlan(name, "helix", numbers, table.point("centre", "the centre of the helix at its start"))
        return _with_orientations(table, robot, helix)
    table.require_known(("name", "recording", "until"))
    file = file_relative_to_plan(table, table.text("recording", "name a recording with winch speeds"))
    recording = read_recording(file, robot.cable_count, robot.recorded_columns)
    duration, second_time = recording.duration, float(recording.time[1] - recording.time[0])
    until = table.number("until", UNTIL_RULE) if "until" in table.content else duration
    if until < second_time:
        table.refuse("until", f"is {until!r}, before the recording's second sample", f"write {second_time:g} or more")
    platform = at_recorded_start(robot, recording)[0].platform
    return PathPlan(
        name,
        "recording",
        {"duration": min(until, duration)},
        start=None if platform.start == robot.platform.start else platform.start,
        recording=str(file),
        digest=file_digest(file),
        start_orientation=(
            None if platform.start_orientation == robot.platform.start_orientation else platform.start_orientation
        ),
    )


def _with_orientations(table: CheckedTable, robot: Robot, path: PathPlan) -> PathPlan:
    """The path with the orientations of its table, which only a platform that turns may have."""
    orientations: dict[str, Quaternion] = {}
    for key in (key for key in ORIENTATION_KEYS if key in table.content):
        if not robot.platform.is_rigid_body:
            hint = f"remove {key}, or give [platform] of the robot file an inertia"
            table.refuse(key, "turns the platform, which is a point mass", hint)
        w, x, y, z = table.unit_vector(key, "the unit quaternion [w, x, y, z]", Platform.start_orientation)
        orientations[key] = (w, x, y, z)
    start, end = (orientations.get(key) for key in ORIENTATION_KEYS)
    return replace(path, start_orientation=start, end_orientation=end)
