"""One recording of a campaign traced: a row with the verdict, and the whole report as JSON."""

from __future__ import annotations

import json
from pathlib import Path

from ..recordings.recording import Recording, read_recording
from ..report.document import trace_document
from ..robots.reading import robot_from
from ..tracer import trace
from .plan import Plan
from .rows import FAILURE, Row
from .run import reason_of


def traced_row(plan: Plan, index: int, recording: Recording) -> Row:
    """Trace a recording against the plan's robot; what that fails with is the row's reason.

    Raises OSError where the machine fails, not the trace.
    """
    alpha = plan.trace.alpha if plan.trace else 0.01
    row = row_of_recording(index, recording.path)
    try:
        document = trace_document(trace(robot_from(dict(plan.content), plan.file), recording, alpha=alpha))
    except OSError:
        raise
    except Exception as error:
        return {**row, FAILURE: reason_of(error)}
    # How long it took is no part of what it found, and the same plan is to give the same rows.
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


def row_of_recording(index: int, path: str) -> Row:
    """A row that says which recording it is of."""
    return {"index": index, "recording": Path(path).name}


def recording_of(plan: Plan, index: int, cable_count: int) -> Recording:
    """The recording of a run; raises RecordingError where the file is none."""
    return read_recording(plan.trace.recordings[index] if plan.trace else "", cable_count)
