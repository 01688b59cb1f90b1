"""Reading plans: TOML with every key checked, against the robot file that it names."""

from __future__ import annotations

import hashlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError, RobotFileError, shown
from ..input_file import read_bytes, require_text
from ..recordings.recording import read_recording
from ..robots.checked_table import CheckedTable, NumberRule, nearest
from ..robots.reading import robot_content, robot_from
from .errors import PlanError
from .found import found_inputs
from .keys import KeyPathError, with_values
from .plan import (
    BELIEFS,
    CONTROLLERS,
    METHODS,
    OPEN_LOOP,
    Compute,
    Correlation,
    Input,
    PathPlan,
    Plan,
    TracePlan,
)
from .sampling import correlated_groups, middle, sobol_block
from .vary import inputs_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

KEYS = (
    "robot",
    "seed",
    "believes",
    "controllers",
    "sample",
    "vary",
    "found",
    "correlation",
    "path",
    "compute",
    "trace",
)
NOT_TRACED = ("sample", "vary", "found", "correlation", "path", "controllers", "believes", "compute")
LARGEST_PLAN = 1_000_000  # bytes
MOST_RUNS = 10_000_000
RECORDINGS = (".csv", ".parquet", ".mf4", ".mdf")

SEED = NumberRule("a seed", "", 0.0, 2.0**53, default=0.0)
COUNT = NumberRule("the number of samples", "", 1.0, float(MOST_RUNS))
COEFFICIENT = NumberRule("the correlation", "", -0.999, 0.999)
ALPHA = NumberRule("the rate of false alarms allowed", "", 1e-9, 0.5, default=TracePlan.alpha)
DURATION = NumberRule("how long the path takes", "s", 1e-3, 1e5)
STEP = NumberRule("the longest macro step", "s", 1e-4, 1.0, default=Compute.step)
SETTLE = NumberRule("how long runs go on after a path", "s", minimum=0.0, maximum=1e4, default=Compute.settle)
SERIES = NumberRule("the points of each motion to keep", "", 0.0, 10_000.0, default=float(Compute.series))
UNTIL = NumberRule("where the recording is left", "s", 1e-3, 1e6)
HELIX = {
    "radius": NumberRule("the helix's radius", "m", positive=True),
    "rise": NumberRule("how far the helix rises", "m"),
    "angle": NumberRule("how far the helix turns", "rad"),
    "duration": DURATION,
}


def read_plan(path: str | Path) -> Plan:
    """The plan that a file holds; files that it names are sought beside it.

    Raises PlanError, RobotFileError or RecordingError where it, or what it names, is wrong.
    """
    table = _table(Path(path))
    table.require_known(KEYS)
    robot_file = _beside(table, table.text("robot", 'name the robot file, as in robot = "robot.toml"'))
    content = robot_content(robot_file)
    cables = robot_from(content, robot_file).cable_count
    seed = _whole(table, "seed", SEED)
    if "trace" in table.content:
        return Plan(str(robot_file), content, seed, "grid", paths=(), trace=_trace(table, cables))
    content, inputs, notes = _inputs(table, content)
    method, count = _sample(table, inputs)
    plan = Plan(
        file=str(robot_file),
        content=content,
        seed=seed,
        method=method,
        count=count,
        inputs=inputs,
        correlations=_correlations(table, inputs, method),
        paths=_paths(table, cables, inputs),
        controllers=_controllers(table),
        belief=_one_of(table, "believes", BELIEFS) or BELIEFS[0],
        compute=_compute(table),
        notes=notes,
    )
    if method == "saltelli":
        if plan.correlations and len(set(correlated_groups(plan))) == 1:
            mend = 'choose method = "sobol", or let one more number vary'
            table.refuse("sample.method", "is saltelli, but all inputs are correlated: they share one index, 1", mend)
        plan = replace(plan, count=count * sobol_block(plan))
    _require_possible(table, plan, robot_file)
    return plan


def _table(path: Path) -> CheckedTable:
    text = read_bytes(path, PlanError, LARGEST_PLAN)
    require_text(text, str(path), PlanError, "TOML")
    try:
        content = tomllib.loads(text.decode("utf-8-sig"))
    except (ValueError, RecursionError) as problem:
        raise PlanError(str(path), f"is not TOML ({problem})", "correct it there") from problem
    return CheckedTable(str(path), "", content, _refuse)


def _refuse(error: RobotFileError) -> NoReturn:
    raise PlanError(error.where, error.problem, error.mend)


def _beside(table: CheckedTable, name: str | None) -> Path:
    return (Path(table.file).parent / str(name)).absolute()


def _whole(table: CheckedTable, key: str, rule: NumberRule) -> int:
    number = table.number(key, rule)
    if number != int(number):
        table.refuse(key, f"is {number!r}, not a whole number", rule.mend())
    return int(number)


def _one_of(table: CheckedTable, key: str, known: tuple[str, ...]) -> str:
    """The text under a key, one of those known; empty where it is absent."""
    if key not in table.content:
        return ""
    listed = ", ".join(f'"{each}"' for each in known)
    given = table.text(key, f"write one of {listed}") or ""
    if given not in known:
        table.refuse(key, f"is {shown(given)}, must be one of {listed}", f"write {nearest(given, known)}")
    return given


def _flag(table: CheckedTable, key: str, default: bool) -> bool:
    value = table.content.get(key, default)
    if not isinstance(value, bool):
        table.refuse(key, f"is {shown(value)}, not true or false", f"write {key} = true or {key} = false")
    return bool(value)


def _inputs(table: CheckedTable, content: dict[str, Any]) -> tuple[dict[str, Any], tuple[Input, ...], tuple[str, ...]]:
    """The robot file's content with what a trace found, all inputs, and what the user should know."""
    inputs: tuple[Input, ...] = ()
    notes: tuple[str, ...] = ()
    found = table.table("found")
    if found is not None:
        found.require_known(("report",))
        report = _beside(found, found.text("report", 'name the report of a trace, as in report = "report/report.json"'))
        content, inputs, notes = found_inputs(report, content)
    vary = table.table("vary")
    if vary is not None:
        inputs += inputs_of(vary, content)
    for place, each in enumerate(inputs):
        if each.key in {other.key for other in inputs[:place]}:
            (vary or table).refuse(each.key, "varies twice", "let it vary once; [found] has the effects of its report")
    return content, inputs, notes


def _sample(table: CheckedTable, inputs: tuple[Input, ...]) -> tuple[Any, int]:
    """The method, and the number of samples."""
    sample = table.table("sample")
    if sample is None:
        if inputs:
            mend = 'add [sample] with method = "sobol" and count = 64, or method = "grid"'
            table.refuse("sample", "is missing", mend)
        return "grid", 1
    sample.require_known(("method", "count"))
    method = _one_of(sample, "method", METHODS) or METHODS[0]
    if not inputs:
        sample.refuse("", "samples nothing", "add [vary] with a key of the robot file, or remove [sample]")
    if method == "grid":
        if "count" in sample.content:
            sample.refuse("count", "is given, a grid has as many as its lists make", "remove it")
        count = 1
        for each in inputs:
            if not each.distribution.steps:
                mend = "write a list or a linspace, or choose another method"
                table.refuse("vary", f"lets {each.key} be {each.distribution.kind}, a grid takes steps", mend)
            count *= len(each.distribution.steps)
    else:
        count = _whole(sample, "count", COUNT)
        if method in ("sobol", "saltelli") and count & (count - 1):
            low = 1 << (count.bit_length() - 1)
            sample.refuse("count", f"is {count}, must be a power of 2 for {method}", f"write {low} or {2 * low}")
    return method, count


def _correlations(table: CheckedTable, inputs: tuple[Input, ...], method: str) -> tuple[Correlation, ...]:
    found = []
    keys = [each.key for each in inputs]
    for one in table.tables("correlation") if "correlation" in table.content else ():
        one.require_known(("between", "value"))
        between = one.content.get("between")
        if not (isinstance(between, list) and len(between) == 2 and between[0] != between[1]):
            one.refuse("between", "does not name two keys", 'write between = ["cable.modulus", "platform.mass"]')
            continue
        for key in between:
            if key not in keys:
                one.refuse("between", f"names {shown(key)}, which does not vary", f"write {nearest(str(key), keys)}")
        if method == "grid":
            one.refuse("", "correlates numbers of a grid", "remove it, or choose another method")
        found.append(Correlation(keys.index(between[0]), keys.index(between[1]), one.number("value", COEFFICIENT)))
    return tuple(found)


def _paths(table: CheckedTable, cable_count: int, inputs: tuple[Input, ...]) -> tuple[PathPlan, ...]:
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
    file = _beside(table, table.text("recording", "name a recording with winch speeds"))
    duration = read_recording(file, cable_count).duration
    until = table.number("until", UNTIL) if "until" in table.content else duration
    return PathPlan(name, "recording", {"duration": min(until, duration)}, None, None, str(file), digest_of(file))


def _controllers(table: CheckedTable) -> tuple[str, ...]:
    if "controllers" not in table.content:
        return (OPEN_LOOP,)
    given = table.content["controllers"]
    listed = ", ".join(f'"{each}"' for each in CONTROLLERS)
    if not isinstance(given, list) or not given:
        table.refuse("controllers", f"is {shown(given)}, not a list of controllers", f"name some of {listed}")
    for name in given:
        if name not in CONTROLLERS:
            mend = f"write {nearest(str(name), CONTROLLERS)}"
            table.refuse("controllers", f"has {shown(name)}, must be one of {listed}", mend)
    if "path" not in table.content:
        table.refuse("controllers", "have no path to follow", "add [[path]], or remove controllers")
    return tuple(dict.fromkeys(given))


def _compute(table: CheckedTable) -> Compute:
    compute = table.table("compute")
    if compute is None:
        return Compute()
    compute.require_known(("statics", "modes", "step", "settle", "series", "noise"))
    return Compute(
        statics=_flag(compute, "statics", Compute.statics),
        modes=_flag(compute, "modes", Compute.modes),
        step=compute.number("step", STEP),
        settle=compute.number("settle", SETTLE),
        series=_whole(compute, "series", SERIES),
        noise=_flag(compute, "noise", Compute.noise),
    )


def _trace(table: CheckedTable, cable_count: int) -> TracePlan:
    for key in NOT_TRACED:
        if key in table.content:
            table.refuse(key, "has no part in a trace of recordings", "remove it, or make two plans")
    trace = table.table("trace")
    if trace is None:
        return TracePlan((), ())
    trace.require_known(("recordings", "alpha"))
    folder = _beside(trace, trace.text("recordings", 'name a folder, as in recordings = "season"'))
    if not folder.is_dir():
        trace.refuse("recordings", f"is {shown(str(folder))}, no folder", "name a folder of recordings")
    files = sorted(each for each in folder.iterdir() if each.suffix.lower() in RECORDINGS and each.is_file())
    if not files:
        trace.refuse("recordings", f"has no recording in {folder}", f"put files there that end in {RECORDINGS}")
    return TracePlan(tuple(map(str, files)), tuple(map(digest_of, files)), trace.number("alpha", ALPHA))


def digest_of(file: Path) -> str:
    """What tells the contents of files apart."""
    return hashlib.sha256(read_bytes(file, PlanError)).hexdigest()[:16]


def _require_possible(table: CheckedTable, plan: Plan, robot_file: Path) -> None:
    """Refuse keys that lead nowhere, each at the middle of its distribution, by the robot file's own rules."""
    if plan.paths and any(path.kind == "recording" for path in plan.paths) and plan.controllers != (OPEN_LOOP,):
        table.refuse("controllers", "cannot follow a recording, which is winch speeds", "remove controllers")
    if not (plan.paths or plan.compute.statics or plan.compute.modes):
        table.refuse("compute", "leaves nothing to compute", "add [[path]], or statics = true or modes = true")
    runs = plan.count * len(plan.variants)
    if runs > MOST_RUNS:
        table.refuse("sample", f"makes {runs} runs, at most {MOST_RUNS} are made", "make it smaller")
    for one in plan.inputs:
        where = f"{table.file}: vary.{one.key}"
        try:
            robot_from(with_values(plan.content, {one.key: middle(one)}), robot_file)
        except KeyPathError as problem:
            raise PlanError(where, problem.problem, problem.mend) from problem
        except InputError as error:
            _, _, key = error.where.rpartition(": ")
            raise PlanError(where, f"does not suit the robot file, {key} {error.problem}", error.mend) from error
