"""What a trace found as inputs of a campaign: normal variables by its numbers, their intervals and correlations."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ..input_file import read_bytes
from ..robots.reading import robot_from
from ..robots.robot import EffectSetting, Robot
from .distributions import NORMAL, Distribution
from .errors import PlanError
from .plan import Correlation, Input

# Half a 95 % interval of a normal variable, in standard deviations.
HALF_INTERVAL = 1.959963984540054
LARGEST_REPORT = 100_000_000  # bytes
MEND = "name the report.json that tautwire trace wrote"


@dataclass(frozen=True)
class FoundInputs:
    """The robot file's ``content`` with the effects of a report on, inputs for their numbers, and notes."""

    content: dict[str, Any]
    inputs: tuple[Input, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    notes: tuple[str, ...] = ()


class Name(NamedTuple):
    """What a report calls a number: an effect, the cables that it acts on, and a parameter."""

    effect: str
    cables: tuple[int, ...]
    parameter: str


@dataclass(frozen=True)
class _Report:
    """A report's numbers: value and standard deviation, None where there is no interval; correlations of pairs."""

    numbers: Mapping[Name, tuple[float, float | None]]
    correlations: Mapping[frozenset[Name], float]


def found_inputs(report: Path, content: Mapping[str, Any], file: Path, correlated: bool = True) -> FoundInputs:
    """What a trace's report makes of the content of the robot ``file``.

    Each number is normal about its value, with its 95 % interval as 1.96 standard deviations to both sides, and where
    ``correlated`` goes together with the others as the report says. One without an interval is set and stays.

    Raises PlanError where the file is no report of a trace, or found no effect.
    """
    found = _read(report)
    tables, places = _effect_tables(_with_effects(robot_from(dict(content), file), found))
    if any((name.effect, name.cables) not in places for name in found.numbers):
        raise PlanError(str(report), "has an effect on a cable twice", MEND)
    inputs: dict[Name, Input] = {}
    notes: list[str] = []
    for name, (value, deviation) in found.numbers.items():
        path = f"{places[name.effect, name.cables]}.{name.parameter}"
        if deviation is None:
            notes.append(f"{path} stays at {value:g}: {report.name} gives it no interval")
        else:
            inputs[name] = Input(path, Distribution(NORMAL, (value, deviation)))
    pairs = list(combinations(range(len(inputs)), 2)) if correlated else []
    known = tuple(_correlations(found, list(inputs), pairs))
    if len(known) < len(pairs):
        lacks = f"{len(pairs) - len(known)} of {len(pairs)} pairs of its numbers"
        notes.append(f"{report.name} gives no correlation of {lacks}: taken as independent")
    return FoundInputs({**content, "effect": tables}, tuple(inputs.values()), known, tuple(notes))


def _read(report: Path) -> _Report:
    try:
        document = json.loads(read_bytes(report, PlanError, LARGEST_REPORT).decode("utf-8"))
        numbers = {
            Name(str(effect["name"]), _cables(effect), str(key)): (_finite(each["value"]), _deviation(each))
            for effect in document["effects"]
            for key, each in effect["parameters"].items()
        }
        correlations = dict(_pairs(document))
    except (ArithmeticError, AttributeError, KeyError, RecursionError, TypeError, ValueError) as problem:
        raise PlanError(str(report), "is no report of a trace", MEND) from problem
    if not numbers:
        raise PlanError(str(report), "found no effect whose numbers could vary", "leave [found] out")
    return _Report(numbers, correlations)


def _cables(named: Mapping[str, Any]) -> tuple[int, ...]:
    return tuple(sorted(int(cable) for cable in named["cables"]))


def _deviation(estimate: Mapping[str, Any]) -> float | None:
    low, high = estimate.get("low"), estimate.get("high")
    if low is None or high is None or not high > low:
        return None
    return _finite(float(high) - float(low)) / (2.0 * HALF_INTERVAL)


def _finite(number: Any) -> float:
    if not isfinite(number):
        raise ValueError(number)
    return float(number)


def _pairs(document: Mapping[str, Any]) -> Iterator[tuple[frozenset[Name], float]]:
    for one in document.get("correlations", ()):
        between = [Name(str(each["name"]), _cables(each), str(each["parameter"])) for each in one["between"]]
        if one["value"] is not None:
            value = float(one["value"])
            if len(set(between)) != 2 or not abs(value) <= 1.0:
                raise ValueError(one)
            yield frozenset(between), value


def _with_effects(robot: Robot, found: _Report) -> Robot:
    """The robot with what was found in place of what it declares where both act."""
    values: dict[tuple[str, tuple[int, ...]], dict[str, float]] = {}
    for name, (value, _) in found.numbers.items():
        values.setdefault((name.effect, name.cables), {})[name.parameter] = value
    for (effect, cables), each in values.items():
        robot = robot.with_effect(EffectSetting(effect, each, cables))
    return robot


def _effect_tables(robot: Robot) -> tuple[dict[str, Any], dict[tuple[str, tuple[int, ...]], str]]:
    """The robot's effects as its file has them, and the path of the table of each by its name and cables."""
    tables: dict[str, Any] = {}
    places: dict[tuple[str, tuple[int, ...]], str] = {}
    for name in dict.fromkeys(setting.name for setting in robot.effects):
        settings = [setting for setting in robot.effects if setting.name == name]
        found = [{**each.values, **_limited(each, robot.cable_numbers)} for each in settings]
        tables[name] = found[0] if len(found) == 1 else found
        for number, setting in enumerate(settings, start=1):
            entry = "" if len(found) == 1 else f"[{number}]"
            places[name, setting.cables] = f"effect.{name}{entry}"
    return tables, places


def _limited(setting: EffectSetting, all_cables: Sequence[int]) -> dict[str, list[int]]:
    return {"cables": list(setting.cables)} if setting.cables not in ((), tuple(all_cables)) else {}


def _correlations(found: _Report, varied: Sequence[Name], pairs: Sequence[tuple[int, int]]) -> Iterator[Correlation]:
    """Those known, of pairs of what varies, by its places."""
    for first, second in pairs:
        value = found.correlations.get(frozenset((varied[first], varied[second])))
        if value is not None:
            yield Correlation(first, second, value)
