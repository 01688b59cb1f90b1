"""Lines of [recording.columns] that a message tells, and whether they mend the recording that it is about."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from tautwire.errors import RecordingError
from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.schema import Robot
from tautwire.toml_text import parse_toml


def told_lines(hint: str, table: str = "recording.columns") -> str:
    """The lines that a hint tells to write into a table, the first where it has alternatives."""
    match = re.search(rf"into \[{re.escape(table)}\] (.*?), (?:which is to|and into) ", hint)
    assert match is not None, hint
    return match.group(1).replace(" and ", "\n")


def told_columns(hint: str, table: str = "recording.columns") -> dict[str, Any]:
    """What those lines declare."""
    return parse_toml(told_lines(hint, table))


def assert_mended_by_told_lines(robot: Robot, recording: Recording, folder: Path) -> RecordingError:
    """The recording is refused as it is, by the error returned, and not with the lines that its message tells."""
    file, columns = folder / "log.csv", folder / "columns.toml"
    recording.frame().dropna(axis="columns", how="all").to_csv(file, index=False)
    (error,) = recording_mistakes(robot, read_recording(file, robot.cable_count))
    columns.write_text(f"[recording.columns]\n{told_lines(error.hint)}\n", encoding="utf-8")
    assert recording_mistakes(robot, read_recording(file, robot.cable_count, columns)) == ()
    return error
