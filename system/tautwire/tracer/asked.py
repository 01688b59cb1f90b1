"""What a program asks a trace of, checked before anything runs."""

from __future__ import annotations

from collections.abc import Callable

from ..arguments import callable_or_none, number_of, of_kind, robot_of, whole_number_of
from ..errors import ArgumentError
from ..recordings.recording import Recording, require_outputs
from ..robots.checked_table import NumberRule
from ..robots.robot import Robot

ALPHA = NumberRule("a rate of false alarms below 1, such as 0.01", "", positive=True)


def require_asked(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Callable[[str, float], None] | None,
    alpha: float,
    processes: int,
) -> None:
    """Refuse what no trace can be made of.

    Raises RecordingError where a recording has no measured output, ArgumentError for all else.
    """
    robot_of("trace: robot", robot)
    callable_or_none("trace: progress", progress)
    rate_of("trace: alpha", alpha)
    whole_number_of("trace: processes", processes, 1, "give how many processes may work at a time")
    recordings = {"fit": fit} | ({} if check is None else {"check": check})
    for name, recording in recordings.items():
        where = f"trace: {name}"
        of_kind(where, recording, Recording, "give what read_recording returns")
        if recording.cable_count != robot.cable_count:
            problem = f"has winch speeds of {recording.cable_count} cables, the robot has {robot.cable_count}"
            raise ArgumentError(where, recording, problem, "give robot and recording that belong together")
        require_outputs(recording)


def rate_of(where: str, value: object) -> float:
    """The rate of false alarms, above 0 and below 1; raises ArgumentError."""
    rate = number_of(where, value, ALPHA)
    if rate >= 1.0:
        raise ArgumentError(where, value, f"is {rate!r}, must be below 1", ALPHA.mend())
    return rate
