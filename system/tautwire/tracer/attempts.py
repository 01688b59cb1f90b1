"""Fit and validation of one hypothesis: what a worker process does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..errors import UnreachableError
from ..robots.robot import Robot
from .data import DataSet
from .filter_step import Noise
from .fit import Fit, Fitter, NoFitError
from .hypotheses import Hypothesis


@dataclass(frozen=True)
class FitTask:
    """Fit of the chosen hypotheses to estimation data, from starts that are tried in turn; validated on other data.

    ``min_log_likelihood`` is that of the data without the last of them; for ``cost_tolerance`` see
    :meth:`Fitter.fit_from`.
    """

    chosen: tuple[Hypothesis, ...]
    starts: tuple[Robot, ...]
    min_log_likelihood: float
    cost_tolerance: float


@dataclass(frozen=True)
class ValidatedFit:
    """A fit with its validation: log-likelihood and mean square of the innovations on validation data."""

    fit: Fit
    log_likelihood: float
    mean_square: float


def fit_and_validate(fitter: Fitter, task: FitTask, data: DataSet, validation: DataSet) -> ValidatedFit | None:
    """Fit and validate a task; None where the cables cannot hold the platform, or nothing finite comes out."""
    try:
        fit = fitter.fit_from(task.starts, task.chosen, data, task.min_log_likelihood, task.cost_tolerance)
        innovations = fitter.judged(fit.robot, task.chosen, validation)
    except (UnreachableError, NoFitError):
        return None
    log_likelihood = innovations.log_likelihood(validation.rows)
    mean_square = float(np.nanmean(innovations.mean_square(validation.rows)))
    return ValidatedFit(fit, log_likelihood, mean_square) if np.isfinite(log_likelihood) else None


def fit_and_validate_in_worker(noise: Noise, task: FitTask, data: DataSet, validation: DataSet) -> ValidatedFit | None:
    """As :func:`fit_and_validate`, in a worker process with its own fitter."""
    return fit_and_validate(worker_fitter(noise), task, data, validation)


@lru_cache(maxsize=1)
def worker_fitter(noise: Noise) -> Fitter:
    """The fitter of this worker process. Its compiled likelihoods serve the next task of the same process."""
    return Fitter(noise)
