"""One hypothesis fitted and judged: what a worker does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..errors import UnreachableError
from ..robots.robot import Robot
from .data import Sample
from .filter_step import Noise
from .fit import Fit, Fitter, NoFitError
from .hypotheses import Hypothesis


@dataclass(frozen=True)
class Task:
    """Fit the chosen hypotheses to a sample, from starts that are tried in turn, and judge them on another.

    ``least`` is the log-likelihood of the sample without the last of them; for ``stop`` see :meth:`Fitter.fit_from`.
    """

    chosen: tuple[Hypothesis, ...]
    starts: tuple[Robot, ...]
    least: float
    stop: float


@dataclass(frozen=True)
class Attempt:
    """A fit, and what it does on the judging samples: log-likelihood, and mean square of the innovations."""

    fit: Fit
    log_likelihood: float
    mean_square: float


def attempt(fitter: Fitter, task: Task, sample: Sample, judge: Sample) -> Attempt | None:
    """None where the cables cannot hold what the task asks for, or nothing finite comes out."""
    try:
        fit = fitter.fit_from(task.starts, task.chosen, sample, task.least, task.stop)
        innovations = fitter.judged(fit.robot, task.chosen, judge)
    except (UnreachableError, NoFitError):
        return None
    likelihood = innovations.log_likelihood(judge.rows)
    square = float(np.nanmean(innovations.mean_square(judge.rows)))
    return Attempt(fit, likelihood, square) if np.isfinite(likelihood) else None


def attempt_apart(noise: Noise, task: Task, sample: Sample, judge: Sample) -> Attempt | None:
    """As :func:`attempt`, in a process that keeps a fitter of its own."""
    return attempt(fitter_apart(noise), task, sample, judge)


@lru_cache(maxsize=1)
def fitter_apart(noise: Noise) -> Fitter:
    """A worker's own. Its compiled likelihoods serve the next task of the same process."""
    return Fitter(noise)
