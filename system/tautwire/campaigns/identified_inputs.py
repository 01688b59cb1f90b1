"""Identified parameters of a trace as inputs of a campaign: normal variables with intervals and correlations."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from tautwire_fmu.laws.effects import BY_NAME

from ..input_files import read_bytes
from ..robot.robot_file_reader import robot_from_content
from ..robot.schema import EffectSetting, Robot
from .campaign_plan import NORMAL, Correlation, Distribution, Input, PlanError

# Half-width of the 95 % interval of a normal variable, in standard deviations.
NORMAL_QUANTILE_975 = 1.959963984540054
MAX_REPORT_SIZE = 100_000_000  # bytes
REPORT_HINT = "name the report.json that tautwire trace wrote"


@dataclass(frozen=True)
class IdentifiedInputs:
    """The robot file's ``content`` with the identified effects, inputs for their parameters, and notes."""

    content: dict[str, Any]
    inputs: tuple[Input, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    notes: tuple[str, ...] = ()


class ParameterName(NamedTuple):
    """Name of a parameter in a report: an effect, the cables that it acts on, and the parameter."""

    effect: str
    cables: tuple[int, ...]
    parameter: str


@dataclass(frozen=True)
class _TraceReport:
    """Estimates of a report: value and standard deviation, None without an interval; correlations of pairs.

    ``omitted`` is what the report's robot file has beside its effects: a formula, and effects too small to matter.
    """

    estimates: Mapping[ParameterName, tuple[float, float | None]]
    correlations: Mapping[frozenset[ParameterName], float]
    omitted: tuple[str, ...]


def identified_inputs(
    report_file: Path, content: Mapping[str, Any], robot_file: Path, correlated: bool = True
) -> IdentifiedInputs:
    """Inputs from a trace's report, with the content of the robot file that has its effects.

    Each parameter is normal about its estimate, its 95 % interval being 1.96 standard deviations to both sides; where
    ``correlated``, with the correlations of the report. A parameter without an interval is set to its estimate.

    Raises PlanError where the file is not a report of a trace, or found no effect.
    """
    report = _read_report(report_file)
    tables, effect_paths = _effect_tables(_robot_with_effects(robot_from_content(dict(content), robot_file), report))
    if any((name.effect, name.cables) not in effect_paths for name in report.estimates):
        raise PlanError(str(report_file), "has an effect on a cable twice", REPORT_HINT)
    inputs: dict[ParameterName, Input] = {}
    notes = [f"{each} of {report_file.name} is left out: its own robot.toml has it" for each in report.omitted]
    for name, (value, deviation) in report.estimates.items():
        path = f"{effect_paths[name.effect, name.cables]}.{name.parameter}"
        if deviation is None:
            notes.append(f"{path} stays at {value:g}: {report_file.name} gives it no interval")
        else:
            inputs[name] = Input(path, Distribution(NORMAL, (value, deviation)))
    pairs = list(combinations(range(len(inputs)), 2)) if correlated else []
    correlations = tuple(_known_correlations(report, list(inputs), pairs))
    if len(correlations) < len(pairs):
        missing_pairs = f"{len(pairs) - len(correlations)} of {len(pairs)} pairs of its numbers"
        notes.append(f"{report_file.name} gives no correlation of {missing_pairs}: taken as independent")
    return IdentifiedInputs({**content, "effect": tables}, tuple(inputs.values()), correlations, tuple(notes))


def _read_report(report_file: Path) -> _TraceReport:
    try:
        document = json.loads(read_bytes(report_file, PlanError, MAX_REPORT_SIZE).decode("utf-8"))
        estimates = {
            ParameterName(str(effect["name"]), _cable_numbers(effect), str(key)): (
                _require_finite(each["value"]),
                _standard_deviation(str(effect["name"]), str(key), each),
            )
            for effect in document["effects"]
            for key, each in effect["parameters"].items()
        }
        correlations = dict(_correlation_pairs(document))
        formula, small_effects = document.get("formula"), document.get("small_effects") or ()
        omitted = ([f"the formula {formula}"] if formula else []) + [f"the effect {e['name']}" for e in small_effects]
    except (ArithmeticError, AttributeError, KeyError, RecursionError, TypeError, ValueError) as problem:
        raise PlanError(str(report_file), "is not a report of a trace", REPORT_HINT) from problem
    if not estimates:
        raise PlanError(str(report_file), "has no effect whose parameters could vary", "leave [found] out")
    return _TraceReport(estimates, correlations, tuple(dict.fromkeys(omitted)))


def _cable_numbers(entry: Mapping[str, Any]) -> tuple[int, ...]:
    return tuple(sorted(int(cable) for cable in entry["cables"]))


def _standard_deviation(effect: str, parameter: str, estimate: Mapping[str, Any]) -> float | None:
    """Standard deviation of an estimate by its interval; None where that is open, or ends at the parameter's bound."""
    low, high = estimate.get("low"), estimate.get("high")
    if low is None or high is None or not high > low:
        return None
    deviation = _require_finite(float(high) - float(low)) / (2.0 * NORMAL_QUANTILE_975)
    declared = BY_NAME[effect].parameters if effect in BY_NAME else ()
    is_open = any(each.name == parameter and (low <= each.minimum or high >= each.maximum) for each in declared)
    return None if is_open else deviation


def _require_finite(number: Any) -> float:
    if not isfinite(number):
        raise ValueError(number)
    return float(number)


def _correlation_pairs(document: Mapping[str, Any]) -> Iterator[tuple[frozenset[ParameterName], float]]:
    for correlation in document.get("correlations", ()):
        names = [
            ParameterName(str(each["name"]), _cable_numbers(each), str(each["parameter"]))
            for each in correlation["between"]
        ]
        if correlation["value"] is not None:
            value = float(correlation["value"])
            if len(set(names)) != 2 or not abs(value) <= 1.0:
                raise ValueError(correlation)
            yield frozenset(names), value


def _robot_with_effects(robot: Robot, report: _TraceReport) -> Robot:
    """The robot with the identified effects, which replace declared ones where both act."""
    values: dict[tuple[str, tuple[int, ...]], dict[str, float]] = {}
    for name, (value, _) in report.estimates.items():
        values.setdefault((name.effect, name.cables), {})[name.parameter] = value
    for (effect, cables), effect_values in values.items():
        robot = robot.with_effect(EffectSetting(effect, effect_values, cables))
    return robot


def _effect_tables(robot: Robot) -> tuple[dict[str, Any], dict[tuple[str, tuple[int, ...]], str]]:
    """The robot's effects as tables of its file, and the key path of each table by effect name and cables."""
    tables: dict[str, Any] = {}
    effect_paths: dict[tuple[str, tuple[int, ...]], str] = {}
    for name in dict.fromkeys(setting.name for setting in robot.effects):
        settings = [setting for setting in robot.effects if setting.name == name]
        entries = [{**each.values, **_cable_restriction(each, robot.cable_numbers)} for each in settings]
        tables[name] = entries[0] if len(entries) == 1 else entries
        for number, setting in enumerate(settings, start=1):
            suffix = "" if len(entries) == 1 else f"[{number}]"
            effect_paths[name, setting.cables] = f"effect.{name}{suffix}"
    return tables, effect_paths


def _cable_restriction(setting: EffectSetting, all_cables: Sequence[int]) -> dict[str, list[int]]:
    return {"cables": list(setting.cables)} if setting.cables not in ((), tuple(all_cables)) else {}


def _known_correlations(
    report: _TraceReport, names: Sequence[ParameterName], pairs: Sequence[tuple[int, int]]
) -> Iterator[Correlation]:
    """Correlations in the report of pairs of inputs, by their indices."""
    for first, second in pairs:
        value = report.correlations.get(frozenset((names[first], names[second])))
        if value is not None:
            yield Correlation(first, second, value)
