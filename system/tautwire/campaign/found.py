"""What a trace found as inputs of a campaign: its numbers with their intervals as normal distributions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from ..input_file import read_bytes
from .distributions import NORMAL, Distribution
from .errors import PlanError
from .plan import Input

# Half a 95 % interval of a normal variable, in standard deviations.
HALF_INTERVAL = 1.959963984540054
LARGEST_REPORT = 100_000_000  # bytes
UNCORRELATED = "the report holds no correlations: its numbers vary independently; [[correlation]] sets them"


def found_inputs(report: Path, content: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[Input, ...], tuple[str, ...]]:
    """The robot file's content with the effects of a report on, an input for each of their numbers, and notes.

    Each is normal about its value, with its 95 % interval as 1.96 standard deviations to both sides. A number without
    an interval is set and stays.

    Raises PlanError where the file is no report of a trace, or found no effect.
    """
    found: dict[str, Any] = deepcopy(dict(content))
    inputs: list[Input] = []
    notes: list[str] = []
    count = len(found.get("cable", ()))
    for effect in _effects(report):
        name, cables = effect["name"], list(effect.get("cables", ()))
        values = {key: float(each["value"]) for key, each in effect["parameters"].items()}
        place = _switched_on(found, name, cables if 0 < len(cables) < count else [], values, count)
        for key, each in effect["parameters"].items():
            path = f"{place}.{key}"
            low, high = each.get("low"), each.get("high")
            if low is None or high is None or not high > low:
                notes.append(f"{path} stays at {values[key]:g}: {report.name} gives it no interval")
                continue
            deviation = (float(high) - float(low)) / (2.0 * HALF_INTERVAL)
            inputs.append(Input(path, Distribution(NORMAL, (values[key], deviation))))
    return found, tuple(inputs), (*notes, *([UNCORRELATED] if len(inputs) > 1 else []))


def _effects(report: Path) -> list[Mapping[str, Any]]:
    mend = "name the report.json that tautwire trace wrote"
    try:
        document = json.loads(read_bytes(report, PlanError, LARGEST_REPORT).decode("utf-8"))
        effects = document["effects"]
        for effect in effects:
            str(effect["name"]), [float(each["value"]) for each in effect["parameters"].values()]
    except (ValueError, KeyError, TypeError, AttributeError) as problem:
        raise PlanError(str(report), "is no report of a trace", mend) from problem
    if not effects:
        raise PlanError(str(report), "found no effect whose numbers could vary", "leave [found] out")
    return list(effects)


def _switched_on(content: dict[str, Any], name: str, cables: list[int], values: Mapping[str, float], count: int) -> str:
    """Switch an effect on where it is not yet, set its numbers, and return the path of its table."""
    effects = content.setdefault("effect", {})
    limited = {"cables": cables} if cables else {}
    if name not in effects:
        effects[name] = {**values, **limited}
        return f"effect.{name}"
    if isinstance(effects[name], dict):
        if _cables(effects[name], count) == (cables or list(range(1, count + 1))):
            effects[name].update(values)
            return f"effect.{name}"
        effects[name] = [effects[name]]
    for place, one in enumerate(effects[name], start=1):
        if _cables(one, count) == (cables or list(range(1, count + 1))):
            one.update(values)
            return f"effect.{name}[{place}]"
    effects[name].append({**values, **limited})
    return f"effect.{name}[{len(effects[name])}]"


def _cables(table: Mapping[str, Any], count: int) -> list[int]:
    return sorted(table.get("cables", range(1, count + 1)))
