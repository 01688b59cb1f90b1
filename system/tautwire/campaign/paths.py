"""The tables ``[[path]]`` of a plan: lines, helices and recorded winch speeds."""

from __future__ import annotations

from ..errors import format_value
from ..recordings.recording import read_recording
from ..robots.checked_table import CheckedTable, NumberRule
from ..trajectory import ANGLE_RULE, RADIUS_RULE, RISE_RULE
from ..trajectory import DURATION_RULE as OF_PATH
from .plan import Input, PathPlan
from .values import file_digest, file_relative_to_plan

# Narrower than for one run: an error in a plan is repeated in many runs.
DURATION_RULE = OF_PATH._replace(minimum=1e-3, maximum=1e5)
UNTIL_RULE = NumberRule("where the recording is left", "s", 1e-3, 1e6)
HELIX_RULES = {
    "radius": RADIUS_RULE._replace(positive=True),
    "rise": RISE_RULE,
    "angle": ANGLE_RULE,
    "duration": DURATION_RULE,
}


def read_paths(table: CheckedTable, cable_count: int, inputs: tuple[Input, ...]) -> tuple[PathPlan, ...]:
    """Read all paths of a plan; names must be unique."""
    paths: list[PathPlan] = []
    for number, path_table in enumerate(table.tables("path") if "path" in table.content else (), start=1):
        path = _read_path(path_table, f"path {number}", cable_count)
        if path.name in [each.name for each in paths]:
            path_table.refuse("name", f"is {format_value(path.name)} again", "give each path its own name")
        start_varies = any(each.key.startswith("platform.start") for each in inputs)
        if start_varies and (path.kind == "helix" or path.start is not None):
            path_table.refuse("", "starts where it says, but platform.start varies", "leave start out of a line")
        paths.append(path)
    return tuple(paths)


def _read_path(table: CheckedTable, default: str, cable_count: int) -> PathPlan:
    hint = 'give the path a name of one line, as in name = "up"'
    name = (table.text("name", hint) or "") if "name" in table.content else default
    if not name.strip() or not name.isprintable():
        table.refuse("name", f"is {format_value(name)}", hint)
    kind_keys = [key for key in ("end", "radius", "recording") if key in table.content]
    if len(kind_keys) != 1:
        hint = "give end and duration (a line), centre, radius, rise, angle and duration (a helix), or recording"
        table.refuse("", "is no path" if not kind_keys else f"has {' and '.join(kind_keys)}", hint)
    if kind_keys == ["end"]:
        table.require_known(("name", "start", "end", "duration"))
        start = table.point("start", "where the line starts") if "start" in table.content else None
        end = table.point("end", "where the line ends")
        return PathPlan(name, "line", {"duration": table.number("duration", DURATION_RULE)}, start, end)
    if kind_keys == ["radius"]:
        table.require_known(("name", "centre", *HELIX_RULES))
        numbers = {key: table.number(key, rule) for key, rule in HELIX_RULES.items()}
        return PathPlan(name, "helix", numbers, table.point("centre", "the centre of the helix at its start"))
    table.require_known(("name", "recording", "until"))
    file = file_relative_to_plan(table, table.text("recording", "name a recording with winch speeds"))
    recording = read_recording(file, cable_count)
    duration, second_time = recording.duration, float(recording.time[1] - recording.time[0])
    until = table.number("until", UNTIL_RULE) if "until" in table.content else duration
    if until < second_time:
        table.refuse("until", f"is {until!r}, before the recording's second sample", f"write {second_time:g} or more")
    return PathPlan(name, "recording", {"duration": min(until, duration)}, None, None, str(file), file_digest(file))
