"""Reader of plan files: TOML with every key checked against the robot file that it names."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError, RobotFileError, format_value
from ..input_files import read_bytes, require_utf8_text
from ..name_suggestions import suggest_name
from ..recordings.ros_bag import is_bag
from ..robot.checked_table import CheckedTable
from ..robot.robot_file_reader import robot_content, robot_from_content
from ..robot.schema import Robot
from ..toml_text import parse_toml
from ..validation import NumberRule
from .campaign_plan import (
    BELIEFS,
    CONTROLLERS,
    METHODS,
    OPEN_LOOP,
    Compute,
    Correlation,
    Input,
    PathPlan,
    Plan,
    PlanError,
    TracePlan,
)
from .identified_inputs import IdentifiedInputs, identified_inputs
from .input_sampling import correlated_groups, median_value, saltelli_block_size
from .parameter_space import KeyPathError, leaves_of, read_parameter_space, with_values
from .plan_paths import file_digest, file_relative_to_plan, read_path, read_paths

PLAN_KEYS = (
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
SIMULATION_KEYS = ("sample", "vary", "found", "correlation", "path", "controllers", "believes", "compute")
MAX_PLAN_SIZE = 1_000_000  # bytes
MAX_RUNS = 10_000_000
RECORDING_SUFFIXES = (".csv", ".parquet", ".mf4", ".mdf", ".mat", ".mcap", ".db3")
SEED_RULE = NumberRule("a seed", "", 0.0, 2.0**53, default=0.0)
COUNT_RULE = NumberRule("the number of samples", "", 1.0, float(MAX_RUNS))
CORRELATION_RULE = NumberRule("the correlation", "", -0.999, 0.999)
ALPHA_RULE = NumberRule("the false-alarm rate", "", 1e-9, 0.5, default=TracePlan.alpha)
TIME_LIMIT_RULE = NumberRule("the time limit of each trace", "s", 1.0, 1e6, default=TracePlan.time_limit)
STEP_RULE = NumberRule("the longest macro step", "s", 1e-4, 1.0, default=Compute.step)
SETTLE_RULE = NumberRule(
    "the time that runs continue after a path", "s", minimum=0.0, maximum=1e4, default=Compute.settle
)
SERIES_RULE = NumberRule("the number of points kept of each motion", "", 0.0, 10_000.0, default=float(Compute.series))


def whole_number(table: CheckedTable, key: str, rule: NumberRule) -> int:
    """The whole number under a key, or the rule's default."""
    number = table.number(key, rule)
    if number != int(number):
        table.refuse(key, f"is {number!r}, not a whole number", rule.hint())
    return int(number)


def choice(table: CheckedTable, key: str, choices: tuple[str, ...]) -> str:
    """The text under a key, one of the choices; empty where the key is absent."""
    if key not in table.content:
        return ""
    listed = ", ".join(f'"{each}"' for each in choices)
    value = table.text(key, f"write one of {listed}") or ""
    if value not in choices:
        table.refuse(key, f"is {format_value(value)}, must be one of {listed}", f"write {suggest_name(value, choices)}")
    return value


def flag(table: CheckedTable, key: str, default: bool) -> bool:
    """The boolean under a key, or the default where the key is absent."""
    value = table.content.get(key, default)
    if not isinstance(value, bool):
        table.refuse(key, f"is {format_value(value)}, not true or false", f"write {key} = true or {key} = false")
    return bool(value)


def read_path_file(path: str | Path, robot: Robot) -> PathPlan:
    """Read a file of one path, a line or a helix: the keys of a plan's ``[[path]]``.

    Raises PlanError where it is invalid.
    """
    table = _load_plan(Path(path))
    if "recording" in table.content:
        table.refuse("recording", "is no path of the platform", "give end and duration, or a helix")
    return read_path(table, "path", robot)


def read_plan(path: str | Path) -> Plan:
    """Read a plan file; files that it names are relative to it.

    Raises PlanError, RobotFileError or RecordingError where it, or a file that it names, is invalid, UnreachableError
    where the cables cannot hold the platform where a recorded path starts.
    """
    table = _load_plan(Path(path))
    table.require_known(PLAN_KEYS)
    robot_file = file_relative_to_plan(table, table.text("robot", 'name the robot file, as in robot = "robot.toml"'))
    content = robot_content(robot_file)
    robot = robot_from_content(content, robot_file)
    seed = whole_number(table, "seed", SEED_RULE)
    if "trace" in table.content:
        return Plan(str(robot_file), content, seed, "grid", paths=(), trace=_read_trace(table))
    identified = _read_identified_inputs(table, content, robot_file)
    inputs = _read_inputs(table, identified)
    method, count = _read_sample(table, inputs)
    plan = Plan(
        file=str(robot_file),
        content=identified.content,
        seed=seed,
        method=method,
        count=count,
        inputs=inputs,
        correlations=_read_correlations(table, inputs, method, identified.correlations),
        paths=read_paths(table, robot, inputs),
        controllers=_read_controllers(table),
        belief=choice(table, "believes", BELIEFS) or BELIEFS[0],
        compute=_read_compute(table),
        notes=identified.notes,
        fmu_digests=tuple(file_digest(fmu.path) for fmu in robot.fmus),
    )
    if method == "saltelli":
        if plan.correlations and len(set(correlated_groups(plan))) == 1:
            hint = 'choose method = "sobol", or let one more number vary'
            table.refuse("sample.method", "is saltelli, but all inputs are correlated: they share one index, 1", hint)
        plan = replace(plan, count=count * saltelli_block_size(plan))
    _require_feasible(table, plan, robot_file)
    return plan


def _load_plan(path: Path) -> CheckedTable:
    text = read_bytes(path, PlanError, MAX_PLAN_SIZE)
    require_utf8_text(text, str(path), PlanError, "TOML")
    try:
        content = parse_toml(text.decode("utf-8-sig"))
    except (ValueError, RecursionError) as problem:
        raise PlanError(str(path), f"is not TOML ({problem})", "correct it there") from problem
    return CheckedTable(str(path), "", content, _raise_plan_error)


def _raise_plan_error(error: RobotFileError) -> NoReturn:
    raise PlanError(error.where, error.problem, error.hint)


def _read_identified_inputs(table: CheckedTable, content: dict[str, Any], robot_file: Path) -> IdentifiedInputs:
    """The robot file's content with the effects that a trace identified."""
    section = table.table("found")
    if section is None:
        return IdentifiedInputs(content)
    section.require_known(("report", "correlated"))
    hint = 'name the report of a trace, as in report = "report/report.json"'
    report = file_relative_to_plan(section, section.text("report", hint))
    return identified_inputs(report, content, robot_file, flag(section, "correlated", True))


def _read_inputs(table: CheckedTable, identified: IdentifiedInputs) -> tuple[Input, ...]:
    """All inputs, those identified by a trace first."""
    vary = table.table("vary")
    inputs = identified.inputs + (read_parameter_space(vary, identified.content) if vary is not None else ())
    keys_by_leaf: dict[tuple[str | int, ...], str] = {}
    for each in inputs:
        # A key path that leads nowhere is refused where its values are tried.
        with suppress(KeyPathError):
            leaves = leaves_of(identified.content, each.key)
            for other in {keys_by_leaf[leaf] for leaf in leaves & keys_by_leaf.keys()}:
                problem = "varies twice" if other == each.key else f"varies what {other} varies"
                (vary or table).refuse(each.key, problem, "let it vary once; [found] has the effects of its report")
            keys_by_leaf |= dict.fromkeys(leaves, each.key)
    return inputs


def _read_sample(table: CheckedTable, inputs: tuple[Input, ...]) -> tuple[Any, int]:
    """The sampling method and the number of samples."""
    sample = table.table("sample")
    if sample is None:
        if inputs:
            hint = 'add [sample] with method = "sobol" and count = 64, or method = "grid"'
            table.refuse("sample", "is missing", hint)
        return "grid", 1
    sample.require_known(("method", "count"))
    method = choice(sample, "method", METHODS) or METHODS[0]
    if not inputs:
        sample.refuse("", "samples nothing", "add [vary] with a key of the robot file, or remove [sample]")
    if method == "grid":
        if "count" in sample.content:
            sample.refuse("count", "is given, a grid has as many as its lists make", "remove it")
        count = 1
        for each in inputs:
            if not each.distribution.discrete_values:
                hint = "write a list or a linspace, or choose another method"
                table.refuse(
                    "vary", f"lets {each.key} be {each.distribution.kind}, a grid requires list or linspace", hint
                )
            count *= len(each.distribution.discrete_values)
    else:
        count = whole_number(sample, "count", COUNT_RULE)
        if method in ("sobol", "saltelli") and count & (count - 1):
            low = 1 << (count.bit_length() - 1)
            sample.refuse("count", f"is {count}, must be a power of 2 for {method}", f"write {low} or {2 * low}")
    return method, count


def _read_correlations(
    table: CheckedTable, inputs: tuple[Input, ...], method: str, identified: tuple[Correlation, ...]
) -> tuple[Correlation, ...]:
    """Correlations of the trace report and of the plan, which takes precedence."""
    by_pair = {frozenset((each.first, each.second)): each for each in identified}
    keys = [each.key for each in inputs]
    for entry in table.tables("correlation") if "correlation" in table.content else ():
        entry.require_known(("between", "value"))
        between = entry.content.get("between")
        if not (isinstance(between, list) and len(between) == 2 and between[0] != between[1]):
            entry.refuse("between", "does not name two keys", 'write between = ["cable.modulus", "platform.mass"]')
            continue
        for key in between:
            if key not in keys:
                entry.refuse(
                    "between",
                    f"names {format_value(key)}, which does not vary",
                    f"write {suggest_name(str(key), keys)}",
                )
        if method == "grid":
            entry.refuse("", "correlates numbers of a grid", "remove it, or choose another method")
        first, second = (keys.index(key) for key in between)
        by_pair[frozenset((first, second))] = Correlation(first, second, entry.number("value", CORRELATION_RULE))
    return tuple(each for each in by_pair.values() if each.value != 0.0)


def _read_controllers(table: CheckedTable) -> tuple[str, ...]:
    if "controllers" not in table.content:
        return (OPEN_LOOP,)
    names = table.content["controllers"]
    listed = ", ".join(f'"{each}"' for each in CONTROLLERS)
    if not isinstance(names, list) or not names:
        table.refuse("controllers", f"is {format_value(names)}, not a list of controllers", f"name some of {listed}")
    for name in names:
        if name not in CONTROLLERS:
            hint = f"write {suggest_name(str(name), CONTROLLERS)}"
            table.refuse("controllers", f"has {format_value(name)}, must be one of {listed}", hint)
    if "path" not in table.content:
        table.refuse("controllers", "have no path to follow", "add [[path]], or remove controllers")
    return tuple(dict.fromkeys(names))


def _read_compute(table: CheckedTable) -> Compute:
    compute = table.table("compute")
    if compute is None:
        return Compute()
    compute.require_known(("statics", "modes", "step", "settle", "series", "noise"))
    return Compute(
        statics=flag(compute, "statics", Compute.statics),
        modes=flag(compute, "modes", Compute.modes),
        step=compute.number("step", STEP_RULE),
        settle=compute.number("settle", SETTLE_RULE),
        series=whole_number(compute, "series", SERIES_RULE),
        noise=flag(compute, "noise", Compute.noise),
    )


def _read_trace(table: CheckedTable) -> TracePlan:
    for key in SIMULATION_KEYS:
        if key in table.content:
            table.refuse(key, "is not allowed beside [trace]", "remove it, or make two plans")
    trace = table.table("trace")
    if trace is None:
        return TracePlan((), ())
    trace.require_known(("recordings", "alpha", "time_limit"))
    folder = file_relative_to_plan(trace, trace.text("recordings", 'name a folder, as in recordings = "season"'))
    if not folder.is_dir():
        trace.refuse("recordings", f"is {format_value(str(folder))}, no folder", "name a folder of recordings")
    files = sorted(each for each in folder.iterdir() if _is_recording(each))
    if not files:
        hint = f"put files there that end in {', '.join(RECORDING_SUFFIXES)}, or folders of bags"
        trace.refuse("recordings", f"has no recording in {folder}", hint)
    alpha, time_limit = trace.number("alpha", ALPHA_RULE), trace.number("time_limit", TIME_LIMIT_RULE)
    return TracePlan(tuple(map(str, files)), tuple(map(file_digest, files)), alpha, time_limit)


def _is_recording(path: Path) -> bool:
    return is_bag(path) if path.is_dir() else path.suffix.lower() in RECORDING_SUFFIXES


def _require_feasible(table: CheckedTable, plan: Plan, robot_file: Path) -> None:
    """Refuse inputs that the robot file's rules reject, at their medians, at ends that they have, and at each text."""
    if plan.paths and any(path.kind == "recording" for path in plan.paths) and plan.controllers != (OPEN_LOOP,):
        table.refuse("controllers", "cannot follow a recording, which is winch speeds", "remove controllers")
    if not (plan.paths or plan.compute.statics or plan.compute.modes):
        table.refuse("compute", "leaves nothing to compute", "add [[path]], or statics = true or modes = true")
    runs = plan.count * len(plan.variants)
    if runs > MAX_RUNS:
        table.refuse("sample", f"makes {runs} runs, at most {MAX_RUNS} are made", "make it smaller")
    for varied in plan.inputs:
        where = f"{table.file}: vary.{varied.key}"
        try:
            values: tuple[float | str, ...] = (median_value(varied), *varied.distribution.ends)
            for value in varied.distribution.texts or values:
                robot_from_content(with_values(plan.content, {varied.key: value}), robot_file)
        except KeyPathError as problem:
            raise PlanError(where, problem.problem, problem.hint) from problem
        except InputError as error:
            _, _, key = error.where.rpartition(": ")
            raise PlanError(where, f"does not suit the robot file, {key} {error.problem}", error.hint) from error
