"""Trace of one recording of a campaign: a row with the verdict, and the whole report as JSON."""

from __future__ import annotations

import json
from pathlib import Path

from ..recordings.recording import Recording, read_recording
from ..report.document import trace_document
from ..robots.reading import robot_from_content
from ..tracer import trace
from .plan import Plan
from .rows import FAILURE_COLUMN, Row
from .run import failure_reason


def trace_row(plan: Plan, index: int, recording: Recording) -> Row:
    """Trace a recording with the plan's robot as the model; an error becomes the failure reason of the row.

    Raises OSError where the machine fails, not the trace.
    """
    alpha = plan.trace.alpha if plan.trace else 0.01
    row = recording_row(index, recording.path)
    try:
        document = trace_document(trace(robot_from_content(dict(plan.content), plan.file), recording, alpha=alpha))
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


def recording_row(index: int, path: str) -> Row:
    """A row with the index and the name of its recording."""
    return {"index": index, "recording": Path(path).name}


def read_traced_recording(plan: Plan, index: int, cable_count: int) -> Recording:
    """The recording of a run; raises RecordingError where the file is none."""
    return read_recording(plan.trace.recordings[index] if plan.trace else "", cable_count)
