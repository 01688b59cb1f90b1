"""Writes robot files such that they read back as an equal robot."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import RobotFileError
from ..provenance import Provenance
from .robot_file_editor import edited_robot_text
from .robot_file_reader import robot_from_text
from .robot_file_text import completed_robot, robot_text
from .schema import Robot


def write_robot(
    robot: Robot, path: str | Path, provenance: Provenance | None = None, source: str | Path | None = None
) -> None:
    """Writes a robot file atomically, such that it reads back equal, with its provenance as comments at the head.

    Where the robot is a change of one that was read from ``source``, comments, order and layout of that file are kept.

    Raises RobotFileError if no file may declare such a robot, OSError if writing fails.
    """
    text = robot_text(robot)
    if robot_from_text(text, path, robot.name) != completed_robot(robot):
        raise RobotFileError(str(path), "would not read back equal", "build the robot as read_robot does")
    if source is not None:
        text = edited_robot_text(source, robot, path) or text
    if provenance is not None:
        line_end = "\r\n" if "\r\n" in text else "\n"
        text = f"{provenance.comment()}\n".replace("\n", line_end) + text
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        temporary.write_bytes(text.encode("utf-8"))
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
