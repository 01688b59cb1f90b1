"""The columns of a campaign's rows, and of the series beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from ..runs.wiring import AXES
from .plan import Plan

Kind = Literal["whole", "number", "flag", "text"]
Row = dict[str, Any]

MODES = (1, 2, 3)
FAILURE = "failure"


@dataclass(frozen=True)
class RowColumn:
    """A column of the rows: ``unit`` of numbers, empty where there is none; ``role`` tells what it is to the run."""

    name: str
    kind: Kind
    unit: str = ""
    role: Literal["run", "input", "output"] = "output"


def columns_of(plan: Plan, cable_count: int) -> tuple[RowColumn, ...]:
    """All columns of a plan's rows, the last one why a run failed."""
    if plan.trace is not None:
        return (RowColumn("index", "whole", role="run"), *_traced(), RowColumn(FAILURE, "text", role="run"))
    return (
        RowColumn("index", "whole", role="run"),
        RowColumn("sample", "whole", role="run"),
        *((RowColumn("path", "text", role="run"), RowColumn("controller", "text", role="run")) if plan.paths else ()),
        *(RowColumn(each.key, "text" if each.distribution.texts else "number", role="input") for each in plan.inputs),
        *(_statics(cable_count) if plan.compute.statics else ()),
        *(_modes() if plan.compute.modes else ()),
        *(_motion(plan, cable_count) if plan.paths else ()),
        RowColumn(FAILURE, "text", role="run"),
    )


def series_columns(cable_count: int) -> tuple[str, ...]:
    """What is kept of a motion at each of its points, beside the time: position in m, tensions in N."""
    return (*AXES, *(f"tension_{cable}" for cable in range(1, cable_count + 1)))


def _statics(cable_count: int) -> tuple[RowColumn, ...]:
    tensions = (RowColumn(f"static_tension_{cable}", "number", "N") for cable in range(1, cable_count + 1))
    return (RowColumn("held", "flag"), *tensions)


def _modes() -> tuple[RowColumn, ...]:
    return (
        *(RowColumn(f"frequency_{mode}", "number", "Hz") for mode in MODES),
        *(RowColumn(f"damping_ratio_{mode}", "number") for mode in MODES),
        RowColumn("stiffness_least", "number", "N/m"),
    )


def _motion(plan: Plan, cable_count: int) -> tuple[RowColumn, ...]:
    follows = any(path.kind != "recording" for path in plan.paths)
    cables = range(1, cable_count + 1)
    return (
        *(RowColumn(f"end_{axis}", "number", "m") for axis in AXES),
        *((RowColumn(f"path_error_{name}", "number", "m") for name in ("end", "largest", "rms")) if follows else ()),
        *(RowColumn(f"tension_{cable}_{name}", "number", "N") for cable in cables for name in ("least", "largest")),
        RowColumn("slack", "flag"),
        *((RowColumn("limit_broken", "flag"),) if "tension" in plan.content else ()),
    )


def _traced() -> tuple[RowColumn, ...]:
    names = ("position_rms_before", "position_rms_after", "tension_rms_before", "tension_rms_after")
    return (
        RowColumn("recording", "text", role="run"),
        RowColumn("verdict", "text"),
        RowColumn("sentence", "text"),
        RowColumn("effects", "text"),
        *(RowColumn(name, "number", "m" if name.startswith("position") else "N") for name in names),
        RowColumn("noise_after", "flag"),
        RowColumn("report", "text"),
    )
