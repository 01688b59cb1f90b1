"""Errors that campaigns raise."""

from __future__ import annotations

from ..errors import InputError, TautwireError


class PlanError(InputError):
    """A plan that cannot be read, or asks for something impossible."""


class PlanMismatchError(InputError):
    """The folder holds rows of another plan; ``stored_digest`` and ``plan_digest`` are the digests of both."""

    def __init__(self, folder: str, stored_digest: str, plan_digest: str) -> None:
        hint = "choose another --out, or give the plan and the robot file back what they had"
        super().__init__(folder, f"holds rows of another plan ({stored_digest}, this one is {plan_digest})", hint)
        self.stored_digest = stored_digest
        self.plan_digest = plan_digest


class MissingExtraError(InputError):
    """A library that only campaigns need is not installed; ``library`` is its name."""

    def __init__(self, library: str) -> None:
        hint = 'run pip install "dask[distributed]" SALib'
        super().__init__("campaign", f"needs {library}, which is not installed", hint)
        self.library = library


class UnfinishedError(TautwireError):
    """A campaign that ended early: ``written_count`` of ``count`` rows are written, and the same command resumes."""

    def __init__(self, reason: str, written_count: int, count: int) -> None:
        super().__init__(f"{reason} after {written_count} of {count} runs; the same command goes on where it stopped")
        self.reason = reason
        self.written_count = written_count
        self.count = count
