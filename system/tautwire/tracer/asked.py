"""Validation of the arguments of a trace, before anything runs."""

from __future__ import annotations

from collections.abc import Callable

from ..arguments import validate_callable, validate_instance, validate_integer, validate_number, validate_robot
from ..errors import ArgumentError
from ..recordings.recording import Recording, require_outputs
from ..robots.checked_table import NumberRule
from ..robots.robot import Robot

FALSE_ALARM_RATE_RULE = NumberRule("a rate of false alarms below 1, such as 0.01", "", positive=True)


def validate_trace_arguments(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Callable[[str, float], None] | None,
    alpha: float,
    processes: int,
) -> None:
    """Validate the arguments of a trace.

    Raises RecordingError where a recording has no measured output, ArgumentError for all else.
    """
    validate_robot("trace: robot", robot)
    validate_callable("trace: progress", progress)
    validated_false_alarm_rate("trace: alpha", alpha)
    validate_integer("trace: processes", processes, 1, "give how many processes may work at a time")
    recordings = {"fit": fit} | ({} if check is None else {"check": check})
    for name, recording in recordings.items():
        argument = f"trace: {name}"
        validate_instance(argument, recording, Recording, "give what read_recording returns")
        if recording.cable_count != robot.cable_count:
            problem = f"has winch speeds of {recording.cable_count} cables, the robot has {robot.cable_count}"
            raise ArgumentError(argument, recording, problem, "give robot and recording that belong together")
        require_outputs(recording)


def validated_false_alarm_rate(argument: str, value: object) -> float:
    """The false-alarm rate, above 0 and below 1; raises ArgumentError."""
    rate = validate_number(argument, value, FALSE_ALARM_RATE_RULE)
    if rate >= 1.0:
        raise ArgumentError(argument, value, f"is {rate!r}, must be below 1", FALSE_ALARM_RATE_RULE.hint())
    return rate
