"""Traces of many recordings: a row with the verdict of each, and their summary."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from ..estimation import trace
from ..estimation.time_limit import TimeLimit
from ..recordings.recording import Recording
from ..reports.report_folder import trace_document
from ..robot.robot_file_reader import robot_from_content
from .campaign_plan import Plan, TracePlan
from .campaign_run import failure_reason
from .dataset_schema import FAILURE_COLUMN, Row


def trace_row(plan: Plan, index: int, recording: Recording) -> Row:
    """Trace a recording with the plan's robot as the model; an error becomes the failure reason of the row.

    Raises OSError where the machine fails, not the trace.
    """
    options = plan.trace or TracePlan((), ())
    robot, limit = robot_from_content(dict(plan.content), plan.file), TimeLimit(options.time_limit)
    row: Row = {"index": index, "recording": Path(recording.path).name}
    try:
        document = trace_document(trace(robot, recording, alpha=options.alpha, time_limit=limit))
    except OSError:
        raise
    except Exception as error:
        return {**row, FAILURE_COLUMN: failure_reason(error)}
    # The computing time is dropped: the same plan has to give the same rows.
    del document["seconds"]
    errors = {
        f"{quantity}_rms_{when}": document[f"error_{when}"]["fit"][f"{quantity}_rms"]
        for quantity in ("position", "tension")
        for when in ("before", "after")
    }
    return {
        **row,
        "verdict": document["verdict"],
        "sentence": document["sentence"],
        "effects": ", ".join(effect["name"] for effect in document["effects"]),
        **errors,
        "noise_after": document["residual_is_noise"]["after"],
        "report": json.dumps(document),
    }


@dataclass(frozen=True)
class IdentifiedParameter:
    """A parameter identified from one recording, with its 95 % interval; None where a bound does not exist."""

    recording: str
    effect: str
    cables: tuple[int, ...]
    parameter: str
    unit: str
    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class TraceSummary:
    """Summary of all traces: counts of each verdict, and each parameter of each effect over the recordings."""

    count: int
    failed: int
    verdicts: tuple[tuple[str, int], ...]
    findings: tuple[IdentifiedParameter, ...]

    def document(self) -> dict[str, Any]:
        """The summary as JSON-serialisable data."""
        fields = asdict(self)
        fields["verdicts"] = dict(self.verdicts)
        return fields


def summarise_traces(rows: pa.Table) -> TraceSummary:
    """Summary of the rows of a campaign of traces, sorted by index."""
    findings = [
        IdentifiedParameter(
            recording=recording,
            effect=effect["name"],
            cables=tuple(effect["cables"]),
            parameter=name,
            unit=estimate["unit"],
            value=estimate["value"],
            low=estimate["low"],
            high=estimate["high"],
        )
        for recording, report in zip(rows["recording"].to_pylist(), rows["report"].to_pylist(), strict=True)
        for effect in (json.loads(report)["effects"] if report else ())
        for name, estimate in effect["parameters"].items()
    ]
    findings.sort(key=lambda each: (each.effect, each.cables, each.parameter))
    verdicts = Counter(each for each in rows["verdict"].to_pylist() if each is not None)
    failed = sum(each is not None for each in rows[FAILURE_COLUMN].to_pylist())
    return TraceSummary(rows.num_rows, failed, tuple(verdicts.most_common()), tuple(findings))
