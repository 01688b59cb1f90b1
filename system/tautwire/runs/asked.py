"""What a program asks of a run, checked before anything runs."""

from __future__ import annotations

from collections.abc import Callable

from ..arguments import callable_or_none, number_of, of_kind
from ..errors import ArgumentError
from ..fmus.packaging import RobotFmus
from ..robots.checked_table import NumberRule

STEP = NumberRule("the longest macro step", "s", positive=True)
TOLERANCE = NumberRule("the error allowed", "m", positive=True)
UNTIL = NumberRule("the time at which to stop", "s")
PATIENCE = NumberRule("how long an FMU may take for one call, or infinity,", "s", positive=True)


def require_fmus(where: str, fmus: RobotFmus) -> None:
    """Raises ArgumentError unless these are a robot's FMUs, and ours lie where they were built."""
    of_kind(where, fmus, RobotFmus, "give what build_fmus returns")
    lost = [path for name, path in fmus.parts.items() if name not in fmus.own and not path.is_file()]
    if lost:
        raise ArgumentError(where, fmus, f"{lost[0]} is not there", "build them again, into a folder that stays")


def require_options(
    name: str,
    step: float,
    tolerance: float | None,
    progress: Callable[[float], None] | None,
    patience: float | None,
) -> None:
    """Raises ArgumentError, which names the function, for options that no run can have."""
    require_numbers(f"{name}: ", step, tolerance, patience)
    callable_or_none(f"{name}: progress", progress)


def require_numbers(
    before: str, step: float, tolerance: float | None, patience: float | None, until: float | None = None
) -> None:
    """Raises ArgumentError for numbers that no run can have; ``before`` is what stands before an option's name."""
    number_of(f"{before}step", step, STEP, or_infinite=True)
    if tolerance is not None:
        number_of(f"{before}tolerance", tolerance, TOLERANCE)
    if patience is not None:
        number_of(f"{before}patience", patience, PATIENCE, or_infinite=True)
    if until is not None:
        number_of(f"{before}until", until, UNTIL, or_infinite=True)
