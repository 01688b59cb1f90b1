"""Functions of a native winch: its speed loop, and the distances to its limits."""

from __future__ import annotations

import math

from tautwire_fmu.laws import winch_drive as law
from tautwire_fmu.laws.mathematics import Mathematics

from .traced_functions import Columns, TracedFunction, trace_derivative, trace_function

PARAMETERS = 6
DRIVE_SIZE = 6
# Distances to limits, at whose zeros events are.
LIMIT_COUNT = 3
DRIVE_CONSTANTS = len(law.DriveConstants._fields)


def winch_functions() -> tuple[TracedFunction, ...]:
    """``winch_drive``, ``winch_rates``, ``winch_margins``, and ``winch_derivative`` of rates and margins.

    ``drive`` is what follows from the parameters: the constants of the law, the radians of the motor for each metre of
    rope, and the fastest rate in 1/s.
    """
    known = {"states": 2, "command": 1, "drive": DRIVE_SIZE}
    return (
        trace_function("winch_drive", {"parameters": PARAMETERS}, _drive),
        trace_function("winch_rates", known, _rates),
        trace_function("winch_margins", known, _margins),
        trace_derivative("winch_derivative", known, _rates_and_margins, ("states", "command")),
    )


def _drive(m: Mathematics, columns: Columns) -> Columns:
    radius, turns, bandwidth, ratio, speed_limit, acceleration_limit = columns["parameters"]
    frequency = 2.0 * math.pi * bandwidth
    fastest_rate = frequency * m.maximum(1.0, m.maximum(2.0 * ratio, 0.5 / ratio))
    return {"drive": [frequency, ratio, speed_limit, acceleration_limit, turns / radius, fastest_rate]}


def _rates(m: Mathematics, columns: Columns) -> Columns:
    constants = law.DriveConstants(*columns["drive"][:DRIVE_CONSTANTS])
    return {"rates": law.state_rates(m, constants, law.DriveState(*columns["states"]), columns["command"][0])}


def _margins(m: Mathematics, columns: Columns) -> Columns:
    constants = law.DriveConstants(*columns["drive"][:DRIVE_CONSTANTS])
    return {"margins": law.limit_margins(m, constants, law.DriveState(*columns["states"]), columns["command"][0])}


def _rates_and_margins(m: Mathematics, columns: Columns) -> Columns:
    return {**_rates(m, columns), **_margins(m, columns)}
