"""Stability of estimates beside a disturbance: 95 % intervals that hold what stretches and recordings disagree on.

The likelihood's curvature tells how well noise lets a parameter be known where the model is right. No robot's model is:
its gradients by stretch then differ by more. With the score ``g_b`` of each of B stretches at the estimate, and the
Fisher information ``H`` of all,

    V = B / (B - 1) H^-1 (sum_b g_b g_b') H^-1        half-width w = t sqrt V, t Student's with B - 1 degrees

What an effect's formula lacks beside nature's is the same in all stretches; a share of the parameter's distance from
neutral is added for it. The random force is fitted to what an effect leaves, and may take up a part of the effect:
intervals hold the estimates under a smaller force too, and those of the other recording by itself.

Source: White (1982), Econometrica 50(1), 1-25; Liang and Zeger (1986), Biometrika 73(1), 13-22, on scores by cluster.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as students_t

from ..errors import UnreachableError
from .disturbance_fit import joint_fit, with_fitted_disturbance
from .estimation_data import DataSet
from .hypotheses import Hypothesis
from .identification_context import IdentificationContext
from .innovations import Innovations
from .parameter_fit import NORMAL_QUANTILE_95, Fit, Fitter, NoFitError, parameter_bounds, parameter_scales
from .policy import StabilityPolicy

Array = NDArray[np.float64]
BooleanArray = NDArray[np.bool_]
Names = NDArray[np.str_]

# What can account for most of an interval's width.
NOISE, FORM = "noise and what the robot file states as uncertain", "what is allowed for the effect's formula"
STRETCHES = "stretches of a recording that give different values"
SMALLER_FORCE = "another value under a smaller random force"
RECORDINGS = "two recordings that give different values"
# Of the wider of two intervals, beyond which one that holds both is wide because they differ.
HULL_RATIO = 2.0
# Of the half-width by noise, beyond which that by eight stretches is no chance: 1.206 sqrt(chi^2 / 7) at 95 %.
STRETCH_RATIO = 1.71


@dataclass(frozen=True)
class Intervals:
    """Intervals of p parameters from ``low`` to ``high``, (p,) each; ``dominant`` is what makes them wide."""

    low: Array
    high: Array
    dominant: Names

    def hull(self, other: Intervals, difference: str) -> Intervals:
        """The smallest intervals that hold both; ``difference`` is dominant where these are far apart."""
        low, high = np.minimum(self.low, other.low), np.maximum(self.high, other.high)
        widths, other_widths = self.high - self.low, other.high - other.low
        of_wider = np.where(widths >= other_widths, self.dominant, other.dominant)
        is_apart = high - low > HULL_RATIO * np.maximum(widths, other_widths)
        return Intervals(low, high, np.where(is_apart, difference, of_wider))

    def is_apart(self, other: Intervals) -> BooleanArray:
        """Whether they have nothing in common with another's (p,)."""
        apart: BooleanArray = (self.low > other.high) | (other.low > self.high)
        return apart


def stable_intervals(
    context: IdentificationContext, fit: Fit, chosen: Sequence[Hypothesis], neutral_values: Array
) -> tuple[Intervals, BooleanArray]:
    """Intervals of a fit's parameters, and on which (p,) of them the recordings do not agree.

    ``neutral_values`` (p,) are those without the effects.
    """
    split = context.split
    own = _intervals_of_recording(
        context.policy.stability, context.fitter, fit, chosen, split.estimation, neutral_values
    )
    fitter = with_fitted_disturbance(context.fitter, fit.robot, chosen, split.validation)
    try:
        other_fit = fitter.fit_from([fit.robot], chosen, split.validation, -np.inf)
    except (UnreachableError, NoFitError):
        return own, np.zeros(len(fit.values), dtype=bool)
    fitter, other_fit = joint_fit(fitter, other_fit, chosen, split.validation)
    other = _intervals_of_recording(
        context.policy.stability, fitter, other_fit, chosen, split.validation, neutral_values
    )
    return own.hull(other, RECORDINGS), own.is_apart(other)


def _intervals_of_recording(
    policy: StabilityPolicy,
    fitter: Fitter,
    fit: Fit,
    chosen: Sequence[Hypothesis],
    data: DataSet,
    neutral_values: Array,
) -> Intervals:
    """Intervals about a fit under its disturbance, and about one under less of its force if that can be."""
    innovations = fitter.judged(fit.robot, chosen, data)
    intervals = _intervals_about(policy, fit, innovations, data, neutral_values)
    limited = _with_smaller_force(fitter, policy.smaller_force_ratio)
    try:
        fit = limited.fit_from([fit.robot], chosen, data, -np.inf)
    except (UnreachableError, NoFitError):
        return intervals
    innovations = limited.judged(fit.robot, chosen, data)
    if innovations.overall_mean_square(data.rows) > policy.max_mean_square:
        return intervals
    return intervals.hull(_intervals_about(policy, fit, innovations, data, neutral_values), SMALLER_FORCE)


def _intervals_about(
    policy: StabilityPolicy, fit: Fit, innovations: Innovations, data: DataSet, neutral_values: Array
) -> Intervals:
    """Intervals by stretches and curvature, and by what the effect's form may lack."""
    units = parameter_scales(fit.robot, fit.free)
    by_stretch = half_widths_of_stretches(innovations, data.rows, units, policy.stretches)
    by_noise = NORMAL_QUANTILE_95 * fit.standard_deviations
    by_form = policy.form_tolerance * np.abs(fit.values - neutral_values)
    dominant = np.array([NOISE, STRETCHES, FORM])[np.argmax([by_noise, by_stretch / STRETCH_RATIO, by_form], axis=0)]
    half_widths = np.hypot(np.maximum(by_stretch, by_noise), by_form)
    lower, upper = parameter_bounds(fit.robot, fit.free)
    return Intervals(np.maximum(fit.values - half_widths, lower), np.minimum(fit.values + half_widths, upper), dominant)


def _with_smaller_force(fitter: Fitter, ratio: float) -> Fitter:
    disturbance = fitter.noise.disturbance
    if disturbance is None:
        return fitter
    force = replace(disturbance.force, rms=ratio * disturbance.force.rms)
    return fitter.with_disturbance(replace(disturbance, force=force))


def half_widths_of_stretches(innovations: Innovations, rows: BooleanArray, units: Array, stretch_count: int) -> Array:
    """Half-widths (p,) by the scores of stretches.

    Innovations count where ``rows`` (K,) says so; ``units`` (p,) are sizes of the parameters.
    """
    is_counted = innovations.observed & rows[:, None]
    values = np.where(is_counted, innovations.values, 0.0)
    slopes = np.where(is_counted[:, :, None], innovations.sensitivities, 0.0) * units
    covariance = np.linalg.pinv(np.einsum("kmi,kmj->ij", slopes, slopes))
    scores = np.einsum("km,kmi->ki", values, slopes)
    ends = np.searchsorted(np.cumsum(rows), np.sum(rows) * np.arange(1, stretch_count) / stretch_count)
    by_stretch = np.array([part.sum(axis=0) for part in np.split(scores, ends)])
    by_stretch -= by_stretch.mean(axis=0)
    freedom = stretch_count - 1
    spread = stretch_count / freedom * covariance @ (by_stretch.T @ by_stretch) @ covariance
    quantile = float(students_t.ppf(0.975, freedom))
    half_widths: Array = units * quantile * np.sqrt(np.maximum(np.diag(spread), 0.0))
    return half_widths
