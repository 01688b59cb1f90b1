"""What campaigns raise on purpose."""

from __future__ import annotations

from ..errors import InputError, TautwireError


class PlanError(InputError):
    """A plan that cannot be read, or asks for something impossible."""


class OtherPlanError(InputError):
    """A folder whose rows another plan made; ``made_by`` and ``given`` are the digests of both."""

    def __init__(self, folder: str, made_by: str, given: str) -> None:
        mend = "choose another --out, or give the plan and the robot file back what they had"
        super().__init__(folder, f"holds rows of another plan ({made_by}, this one is {given})", mend)
        self.made_by = made_by
        self.given = given


class MissingExtraError(InputError):
    """A library that only campaigns need is not installed; ``library`` is its name."""

    def __init__(self, library: str) -> None:
        mend = 'run pip install "dask[distributed]" SALib'
        super().__init__("campaign", f"needs {library}, which is not installed", mend)
        self.library = library


class UnfinishedError(TautwireError):
    """A campaign that ended early: ``done`` of ``count`` rows are written, and the same command goes on there."""

    def __init__(self, reason: str, done: int, count: int) -> None:
        super().__init__(f"{reason} after {done} of {count} runs; the same command goes on where it stopped")
        self.reason = reason
        self.done = done
        self.count = count
