"""Errors of controller design; each carries its values."""

from __future__ import annotations

from ..errors import InputError


class MarginError(InputError):
    """No controller of a design has the ``required`` disk margin; ``achieved`` is the best one."""

    def __init__(self, where: str, required: float, achieved: float, hint: str) -> None:
        super().__init__(where, f"a disk margin of {required:g} cannot be kept, {achieved:.3g} is the best", hint)
        self.required = required
        self.achieved = achieved
        self.args = (where, required, achieved, hint)


class StretchError(InputError):
    """No winch speeds make the elastic model follow a path; ``time`` in s is where the inverse simulation failed."""

    def __init__(self, where: str, time: float, hint: str) -> None:
        super().__init__(where, f"no winch speeds were found that follow the path at {time:g} s", hint)
        self.time = time
        self.args = (where, time, hint)
