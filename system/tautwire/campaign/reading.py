"""Reading plans: TOML with every key checked, against the robot file that it names."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError, RobotFileError, shown
from ..input_file import read_bytes, require_text
from ..robots.checked_table import CheckedTable, NumberRule, nearest
from ..robots.reading import robot_content, robot_from
from .errors import PlanError
from .found import FoundInputs, found_inputs
from .keys import KeyPathError, with_values
from .paths import paths_in
from .plan import (
    BELIEFS,
    CONTROLLERS,
    METHODS,
    OPEN_LOOP,
    Compute,
    Correlation,
    Input,
    Plan,
    TracePlan,
)
from .sampling import correlated_groups, middle, sobol_block
from .values import digest_of, file_beside, flag, one_of, whole
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
STEP = NumberRule("the longest macro step", "s", 1e-4, 1.0, default=Compute.step)
SETTLE = NumberRule("how long runs go on after a path", "s", minimum=0.0, maximum=1e4, default=Compute.settle)
SERIES = NumberRule("the points of each motion to keep", "", 0.0, 10_000.0, default=float(Compute.series))


def read_plan(path: str | Path) -> Plan:
    """The plan that a file holds; files that it names are sought beside it.

    Raises PlanError, RobotFileError or RecordingError where it, or what it names, is wrong.
    """
    table = _table(Path(path))
    table.require_known(KEYS)
    robot_file = file_beside(table, table.text("robot", 'name the robot file, as in robot = "robot.toml"'))
    content = robot_content(robot_file)
    cables = robot_from(content, robot_file).cable_count
    seed = whole(table, "seed", SEED)
    if "trace" in table.content:
        return Plan(str(robot_file), content, seed, "grid", paths=(), trace=_trace(table, cables))
    found = _found(table, content, robot_file)
    inputs = _inputs(table, found)
    method, count = _sample(table, inputs)
    plan = Plan(
        file=str(robot_file),
        content=found.content,
        seed=seed,
        method=method,
        count=count,
        inputs=inputs,
        correlations=_correlations(table, inputs, method, found.correlations),
        paths=paths_in(table, cables, inputs),
        controllers=_controllers(table),
        belief=one_of(table, "believes", BELIEFS) or BELIEFS[0],
        compute=_compute(table),
        notes=found.notes,
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


def _found(table: CheckedTable, content: dict[str, Any], robot_file: Path) -> FoundInputs:
    """The robot file's content with what a trace found."""
    found = table.table("found")
    if found is None:
        return FoundInputs(content)
    found.require_known(("report", "correlated"))
    mend = 'name the report of a trace, as in report = "report/report.json"'
    report = file_beside(found, found.text("report", mend))
    return found_inputs(report, content, robot_file, flag(found, "correlated", True))


def _inputs(table: CheckedTable, found: FoundInputs) -> tuple[Input, ...]:
    """All inputs, those that a trace found first."""
    vary = table.table("vary")
    inputs = found.inputs + (inputs_of(vary, found.content) if vary is not None else ())
    for place, each in enumerate(inputs):
        if each.key in {other.key for other in inputs[:place]}:
            (vary or table).refuse(each.key, "varies twice", "let it vary once; [found] has the effects of its report")
    return inputs


def _sample(table: CheckedTable, inputs: tuple[Input, ...]) -> tuple[Any, int]:
    """The method, and the number of samples."""
    sample = table.table("sample")
    if sample is None:
        if inputs:
            mend = 'add [sample] with method = "sobol" and count = 64, or method = "grid"'
            table.refuse("sample", "is missing", mend)
        return "grid", 1
    sample.require_known(("method", "count"))
    method = one_of(sample, "method", METHODS) or METHODS[0]
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
        count = whole(sample, "count", COUNT)
        if method in ("sobol", "saltelli") and count & (count - 1):
            low = 1 << (count.bit_length() - 1)
            sample.refuse("count", f"is {count}, must be a power of 2 for {method}", f"write {low} or {2 * low}")
    return method, count


def _correlations(
    table: CheckedTable, inputs: tuple[Input, ...], method: str, found: tuple[Correlation, ...]
) -> tuple[Correlation, ...]:
    """Those that a trace found, and those of the plan, which win."""
    told = {frozenset((each.first, each.second)): each for each in found}
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
        first, second = (keys.index(key) for key in between)
        told[frozenset((first, second))] = Correlation(first, second, one.number("value", COEFFICIENT))
    return tuple(each for each in told.values() if each.value != 0.0)


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
        statics=flag(compute, "statics", Compute.statics),
        modes=flag(compute, "modes", Compute.modes),
        step=compute.number("step", STEP),
        settle=compute.number("settle", SETTLE),
        series=whole(compute, "series", SERIES),
        noise=flag(compute, "noise", Compute.noise),
    )


def _trace(table: CheckedTable, cable_count: int) -> TracePlan:
    for key in NOT_TRACED:
        if key in table.content:
            table.refuse(key, "has no part in a trace of recordings", "remove it, or make two plans")
    trace = table.table("trace")
    if trace is None:
        return TracePlan((), ())
    trace.require_known(("recordings", "alpha"))
    folder = file_beside(trace, trace.text("recordings", 'name a folder, as in recordings = "season"'))
    if not folder.is_dir():
        trace.refuse("recordings", f"is {shown(str(folder))}, no folder", "name a folder of recordings")
    files = sorted(each for each in folder.iterdir() if each.suffix.lower() in RECORDINGS and each.is_file())
    if not files:
        trace.refuse("recordings", f"has no recording in {folder}", f"put files there that end in {RECORDINGS}")
    return TracePlan(tuple(map(str, files)), tuple(map(digest_of, files)), trace.number("alpha", ALPHA))


def _require_possible(table: CheckedTable, plan: Plan, robot_file: Path) -> None:
    """Refuse keys that lead nowhere, by the robot file's own rules, at the middle of numbers and at each text."""
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
            for value in one.distribution.texts or (middle(one),):
                robot_from(with_values(plan.content, {one.key: value}), robot_file)
        except KeyPathError as problem:
            raise PlanError(where, problem.problem, problem.mend) from problem
        except InputError as error:
            _, _, key = error.where.rpartition(": ")
            raise PlanError(where, f"does not suit the robot file, {key} {error.problem}", error.mend) from error
