"""The tables ``[[path]]`` of a plan: lines, helices and recorded winch speeds."""

from __future__ import annotations

from ..errors import shown
from ..recordings.recording import read_recording
from ..robots.checked_table import CheckedTable, NumberRule
from ..trajectory import ANGLE, RADIUS, RISE
from ..trajectory import DURATION as OF_PATH
from .plan import Input, PathPlan
from .values import digest_of, file_beside

# Narrower than for one run: a slip in a plan is made many times over.
DURATION = OF_PATH._replace(minimum=1e-3, maximum=1e5)
UNTIL = NumberRule("where the recording is left", "s", 1e-3, 1e6)
HELIX = {
    "radius": RADIUS._replace(positive=True),
    "rise": RISE,
    "angle": ANGLE,
    "duration": DURATION,
}


def paths_in(table: CheckedTable, cable_count: int, inputs: tuple[Input, ...]) -> tuple[PathPlan, ...]:
    """All paths of a plan, each with a name of its own."""
    found: list[PathPlan] = []
    for place, one in enumerate(table.tables("path") if "path" in table.content else (), start=1):
        path = _path(one, f"path {place}", cable_count)
        if path.name in [each.name for each in found]:
            one.refuse("name", f"is {shown(path.name)} again", "give each path its own name")
        moved = any(each.key.startswith("platform.start") for each in inputs)
        if moved and (path.kind == "helix" or path.start is not None):
            one.refuse("", "starts where it says, but platform.start varies", "leave start out of a line")
        found.append(path)
    return tuple(found)


def _path(table: CheckedTable, default: str, cable_count: int) -> PathPlan:
    mend = 'give the path a name of one line, as in name = "up"'
    name = (table.text("name", mend) or "") if "name" in table.content else default
    if not name.strip() or not name.isprintable():
        table.refuse("name", f"is {shown(name)}", mend)
    kinds = [key for key in ("end", "radius", "recording") if key in table.content]
    if len(kinds) != 1:
        mend = "give end and duration (a line), centre, radius, rise, angle and duration (a helix), or recording"
        table.refuse("", "is no path" if not kinds else f"has {' and '.join(kinds)}", mend)
    if kinds == ["end"]:
        table.require_known(("name", "start", "end", "duration"))
        start = table.point("start", "where the line starts") if "start" in table.content else None
        end = table.point("end", "where the line ends")
        return PathPlan(name, "line", {"duration": table.number("duration", DURATION)}, start, end)
    if kinds == ["radius"]:
        table.require_known(("name", "centre", *HELIX))
        numbers = {key: table.number(key, rule) for key, rule in HELIX.items()}
        return PathPlan(name, "helix", numbers, table.point("centre", "the centre of the helix at its start"))
    table.require_known(("name", "recording", "until"))
    file = file_beside(table, table.text("recording", "name a recording with winch speeds"))
    recording = read_recording(file, cable_count)
    duration, second = recording.duration, float(recording.time[1] - recording.time[0])
    until = table.number("until", UNTIL) if "until" in table.content else duration
    if until < second:
        table.refuse("until", f"is {until!r}, before the recording's second sample", f"write {second:g} or more")
    return PathPlan(name, "recording", {"duration": min(until, duration)}, None, None, str(file), digest_of(file))
