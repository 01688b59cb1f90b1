"""Validates the arguments of a co-simulation before anything runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..errors import ArgumentError
from ..fmus.packaging import RobotFmus
from ..validation import NumberRule, validate_callable, validate_instance, validate_number

STEP_RULE = NumberRule("the longest macro step", "s", positive=True)
TOLERANCE_RULE = NumberRule("the error tolerance", "m", positive=True)
UNTIL_RULE = NumberRule("the stop time", "s")
CALL_TIMEOUT_RULE = NumberRule("the timeout of one FMU call, or infinity,", "s", positive=True)


@dataclass(frozen=True)
class SimulationOptions:
    """Options of a run: the longest macro ``step`` (s), or the global error ``tolerance`` (m) of adaptive steps.

    The run ends at ``until`` (s) where one is given; an FMU call that takes ``call_timeout`` (s) fails. With ``native``
    the FMUs are machine code.
    """

    step: float
    tolerance: float | None = None
    until: float | None = None
    call_timeout: float | None = None
    native: bool = False


def validate_fmus(argument: str, fmus: RobotFmus) -> None:
    """Raises ArgumentError unless these are a robot's FMUs, and our own are still where they were built."""
    validate_instance(argument, fmus, RobotFmus, "give what build_fmus returns")
    missing_paths = [
        path for name, path in fmus.by_component.items() if name not in fmus.user_start_values and not path.is_file()
    ]
    if missing_paths:
        raise ArgumentError(
            argument, fmus, f"{missing_paths[0]} is not there", "build them again, into a folder that stays"
        )


def validate_options(
    function_name: str,
    step: float,
    tolerance: float | None,
    progress: Callable[[float], None] | None,
    call_timeout: float | None,
) -> None:
    """Raises ArgumentError, which names the function, for invalid options of a run."""
    validate_numbers(f"{function_name}: ", step, tolerance, call_timeout)
    validate_callable(f"{function_name}: progress", progress)


def validate_numbers(
    prefix: str, step: float, tolerance: float | None, call_timeout: float | None, until: float | None = None
) -> None:
    """Raises ArgumentError for invalid numbers; ``prefix`` stands before an option's name in the message."""
    validate_number(f"{prefix}step", step, STEP_RULE, allow_infinite=True)
    if tolerance is not None:
        validate_number(f"{prefix}tolerance", tolerance, TOLERANCE_RULE)
    if call_timeout is not None:
        validate_number(f"{prefix}patience", call_timeout, CALL_TIMEOUT_RULE, allow_infinite=True)
    if until is not None:
        validate_number(f"{prefix}until", until, UNTIL_RULE, allow_infinite=True)
