"""Context of an identification: what each of its stages works with, and none of them changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import log

from ..robot.schema import Robot
from .estimation_data import DataSet, DataSplit
from .hypotheses import searched_hypotheses
from .parameter_fit import Fitter
from .policy import DEFAULT_POLICY, IdentificationPolicy
from .time_limit import TimeLimit
from .worker_pool import WorkerPool

Progress = Callable[[str, float], None]


def no_progress(activity: str, fraction: float) -> None:
    """Discards the progress."""


@dataclass(frozen=True)
class IdentificationContext:
    """Context of an identification.

    ``robot`` is as declared, ``alpha`` the false-alarm rate; ``progress`` gets what is being done, and the share of it
    that is done. ``time_limit`` ends its searches.
    """

    robot: Robot
    fitter: Fitter
    split: DataSplit
    alpha: float = DEFAULT_POLICY.selection.false_alarm_rate
    progress: Progress = no_progress
    workers: WorkerPool = field(default_factory=partial(WorkerPool, 1))
    policy: IdentificationPolicy = DEFAULT_POLICY
    time_limit: TimeLimit = field(default_factory=TimeLimit)

    def leave_untried(self, what: str) -> None:
        """Tell what a search that is out of time leaves untried, and end what the worker processes still do for it."""
        self.workers.abandon_calls()
        self.time_limit.leave_untried(f"There was no time for {what}.")

    @property
    def head(self) -> DataSet:
        """The part of the estimation data that ranks hypotheses."""
        return self.split.estimation.head(self.policy.fit)

    def evidence_threshold(self, others: int = 0) -> float:
        """Log-likelihood ratio, ``ln(n / alpha)``, above which one of n hypotheses, and ``others``, is significant.

        Beside a disturbance it also has to be more than the disturbance's own form may lack on validation data.
        """
        has_disturbance = self.fitter.has_disturbance
        by_chance = log((len(searched_hypotheses(self.robot, has_disturbance)) + others) / self.alpha)
        if not has_disturbance:
            return by_chance
        return max(by_chance, self.policy.selection.min_evidence_rate * float(self.split.validation.rows.sum()))
