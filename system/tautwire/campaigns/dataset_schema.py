"""Schema of a campaign's dataset: the columns of its rows and of the time series beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from ..robot.schema import AXES
from .campaign_plan import Plan

ColumnKind = Literal["whole", "number", "flag", "text"]
Row = dict[str, Any]

ORIENTATION_COLUMNS = ("qw", "qx", "qy", "qz")
FAILURE_COLUMN = "failure"


@dataclass(frozen=True)
class RowColumn:
    """A column of the rows: ``unit`` of numbers, empty where there is none; ``role`` in the run."""

    name: str
    kind: ColumnKind
    unit: str = ""
    role: Literal["run", "input", "output"] = "output"


def row_columns(plan: Plan, cable_count: int) -> tuple[RowColumn, ...]:
    """All columns of a plan's rows; the last one is the reason of a failure."""
    if plan.trace is not None:
        return (
            RowColumn("index", "whole", role="run"),
            *_trace_columns(),
            RowColumn(FAILURE_COLUMN, "text", role="run"),
        )
    return (
        RowColumn("index", "whole", role="run"),
        RowColumn("sample", "whole", role="run"),
        *((RowColumn("path", "text", role="run"), RowColumn("controller", "text", role="run")) if plan.paths else ()),
        *(RowColumn(each.key, "text" if each.distribution.texts else "number", role="input") for each in plan.inputs),
        *(_static_columns(cable_count) if plan.compute.statics else ()),
        *(_mode_columns(plan.is_rigid) if plan.compute.modes else ()),
        *(_motion_columns(plan, cable_count) if plan.paths else ()),
        RowColumn(FAILURE_COLUMN, "text", role="run"),
    )


def series_columns(cable_count: int, is_rigid: bool = False) -> tuple[str, ...]:
    """Columns of the time series of a motion, beside the time: position in m, orientation, tensions in N."""
    orientation = ORIENTATION_COLUMNS if is_rigid else ()
    return (*AXES, *orientation, *(f"tension_{cable}" for cable in range(1, cable_count + 1)))


def mode_numbers(is_rigid: bool) -> range:
    """Numbers of a platform's modes, from 1."""
    return range(1, 7 if is_rigid else 4)


def _static_columns(cable_count: int) -> tuple[RowColumn, ...]:
    tensions = (RowColumn(f"static_tension_{cable}", "number", "N") for cable in range(1, cable_count + 1))
    return (RowColumn("held", "flag"), *tensions)


def _mode_columns(is_rigid: bool) -> tuple[RowColumn, ...]:
    return (
        *(RowColumn(f"frequency_{mode}", "number", "Hz") for mode in mode_numbers(is_rigid)),
        *(RowColumn(f"damping_ratio_{mode}", "number") for mode in mode_numbers(is_rigid)),
        RowColumn("stiffness_least", "number", "N/m"),
    )


def _motion_columns(plan: Plan, cable_count: int) -> tuple[RowColumn, ...]:
    has_desired_path = any(path.kind != "recording" for path in plan.paths)
    cables, error_names = range(1, cable_count + 1), ("end", "largest", "rms") if has_desired_path else ()
    return (
        *(RowColumn(f"end_{axis}", "number", "m") for axis in AXES),
        *((RowColumn(f"end_{part}", "number") for part in ORIENTATION_COLUMNS) if plan.is_rigid else ()),
        *(RowColumn(f"path_error_{name}", "number", "m") for name in error_names),
        *((RowColumn(f"path_error_angle_{name}", "number", "rad") for name in error_names) if plan.is_rigid else ()),
        *(RowColumn(f"tension_{cable}_{name}", "number", "N") for cable in cables for name in ("least", "largest")),
        RowColumn("slack", "flag"),
        *((RowColumn("limit_broken", "flag"),) if "tension" in plan.content else ()),
    )


def _trace_columns() -> tuple[RowColumn, ...]:
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
