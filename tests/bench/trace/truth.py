"""The values of the rig as the laws have them, so that intervals can be held against them."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any, NamedTuple

import numpy as np


class Interval(NamedTuple):
    """An estimate with the ends of its 95 % interval."""

    value: float
    low: float
    high: float


NEW_NAMES = {
    ("sensor_gain", "tension"): {"gain": "tension_gain"},
    ("sensor_gain", "position"): {"gain": "position_gain"},
    ("sensor_delay", "tension"): {"seconds": "tension_delay"},
    ("sensor_delay", "position"): {"seconds": "position_delay"},
}


def law_values(name: str, rig: Mapping[str, Any]) -> dict[str, float]:
    """An effect's values in the laws, from those in the rig; cables left out."""
    values = {key: value for key, value in rig.items() if key != "cables"}
    if name == "relaxation":
        return _branches(values)
    if name == "creep" and values.pop("form", "logarithmic") == "viscous":
        return {"fluidity": float(values["compliance"]) / float(values["time"])}
    if name == "friction" and values.pop("law_at", "span") == "cell":
        values["coefficient_at_cell"] = values.pop("coefficient")
    if name == "drag" and "wind" in values:
        values |= {f"wind_{axis}": speed for axis, speed in zip("xyz", values.pop("wind"), strict=True)}
    if name == "sensor_offset":
        return _offsets(values)
    if name == "sensor_delay" and values.pop("form", "delay") == "lag":
        return {"tension_time_constant": float(values["seconds"])}
    if name in ("sensor_gain", "sensor_delay"):
        new = NEW_NAMES[name, values.pop("outputs", "tension")]
        values = {new[key]: value for key, value in values.items()}
    return {key: float(value) for key, value in values.items()}


def in_one_way(name: str, estimates: Mapping[str, Interval]) -> dict[str, Interval]:
    """The same estimates as :func:`law_values` would write them: eccentricity above zero, branches by rising time."""
    result = dict(estimates)
    if name == "drum" and "eccentricity" in result and result["eccentricity"].value < 0.0:
        value, low, high = result["eccentricity"]
        result["eccentricity"] = Interval(-value, -high, -low)
        if "phase" in result:
            result["phase"] = Interval(*(end + pi for end in result["phase"]))
    if name == "relaxation":
        numbers = [number for number in ("", "_2", "_3") if f"time{number}" in result and f"modulus{number}" in result]
        acting = [number for number in numbers if result[f"modulus{number}"].value > 0.0]
        rising = sorted(acting, key=lambda number: result[f"time{number}"].value)
        for number, old in zip(numbers, rising, strict=False):
            result[f"modulus{number}"], result[f"time{number}"] = estimates[f"modulus{old}"], estimates[f"time{old}"]
    return result


def holds(name: str, parameter: str, truth: float, estimate: Interval) -> bool:
    """Whether an interval holds the true value; angles count modulo a turn."""
    if (name, parameter) == ("drum", "phase"):
        truth += 2.0 * pi * round((estimate.value - truth) / (2.0 * pi))
    return estimate.low <= truth <= estimate.high


def _offsets(values: Mapping[str, Any]) -> dict[str, float]:
    if "force" in values:
        return {"tension_offset": float(values["force"])}
    return {f"position_offset_{axis}": float(part) for axis, part in zip("xyz", values["place"], strict=True)}


def _branches(values: Mapping[str, Any]) -> dict[str, float]:
    moduli, times = np.atleast_1d(values["modulus"]), np.atleast_1d(values["time"])
    results = {}
    for index, place in enumerate(np.argsort(times)):
        number = f"_{index + 1}" if index else ""
        results[f"modulus{number}"] = float(moduli[place])
        results[f"time{number}"] = float(times[place])
    return results
