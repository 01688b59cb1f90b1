"""The verdict of a dynamic test on a rope, and the goodness of fit of each model compared in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from .material_table import MaterialTable
from .model_selection import CrossValidation
from .modulus_fit import MaterialFit, whitened_residuals
from .modulus_intervals import confidence_intervals
from .modulus_observations import ModulusObservations
from .table_consistency import ConsistencyCheck
from .viscoelastic_model import Material, storage_modulus, viscous_damping

Array = NDArray[np.float64]
VerdictName = Literal["effects", "none", "unexplained"]
Role = Literal["declared", "constant", "relaxation", "chosen", "rival", "robot"]


@dataclass(frozen=True)
class MaterialOptions:
    """Options of how a table is read and tested.

    ``pair`` are the two columns that are fitted, None for the preferred ones; ``shared_variance`` the share of variance
    that all rows have in common; uncertainties are ``coverage_factor`` standard deviations; ``significance_level`` is
    the rate of false alarms.
    """

    pair: tuple[str, str] | None = None
    shared_variance: float = 0.0
    coverage_factor: float = 1.0
    significance_level: float = 0.01


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval, in SI units; a side is open where only a bound of the model ends it.

    ``declared`` is the constant in present use, None where there is none.
    """

    effect: str
    name: str
    value: float
    unit: str
    low: float
    high: float
    low_is_open: bool
    high_is_open: bool
    declared: float | None = None


@dataclass(frozen=True)
class IdentifiedEffect:
    """A term accepted into the model; ``log_likelihood_ratio`` is the natural log of its likelihood ratio."""

    name: str
    parameters: Mapping[str, Estimate]
    log_likelihood_ratio: float


@dataclass(frozen=True)
class EvaluatedModel:
    """Goodness of fit of one model against the table.

    ``storage_residuals`` and ``damping_residuals``, each (N,), are model less measured in standard deviations of the
    table; ``degrees_of_freedom`` the numbers less free parameters. ``estimates`` is empty for a declared rope;
    ``cross_validation`` is None for one, and where it was not computed.
    """

    role: Role
    label: str
    material: Material
    estimates: tuple[Estimate, ...]
    chi_squared: float
    degrees_of_freedom: int
    p_value: float
    bic: float
    storage_residuals: Array
    damping_residuals: Array
    cross_validation: CrossValidation | None = None


class FitOutcome(NamedTuple):
    """Goodness of fit of one model: chi-squared, degrees of freedom and p value."""

    chi_squared: float
    degrees_of_freedom: int
    p_value: float


@dataclass(frozen=True)
class ErrorAssumption:
    """Goodness of fit of models, by role, under another reading of the table's errors."""

    label: str
    outcomes: Mapping[Role, FitOutcome]


@dataclass(frozen=True)
class StaticCheck:
    """A static test, held out from the fit, against the long-term modulus that a model predicts; all in Pa."""

    role: Role
    measured: float
    uncertainty: float
    predicted: Estimate


@dataclass(frozen=True)
class RmsErrors:
    """Root mean square errors over the rows: storage modulus in Pa, damping in Pa s."""

    storage_modulus_rms: float
    damping_rms: float


@dataclass(frozen=True)
class MaterialVerdict:
    """Verdict on whether one pair of modulus and damping describes a rope, and if not, what does.

    ``models`` has the declared rope, where there is one, first. ``relaxation_floor`` is the minimum of chi-squared over
    damping and any number of branches. ``error_before`` and ``error_after`` are of the declared rope (else the best
    constant one) and of the chosen model: ``fit`` for rows that were fitted, ``check`` for each row predicted from the
    others.
    """

    verdict: VerdictName
    table: MaterialTable
    pair: tuple[str, str]
    options: MaterialOptions
    observations: ModulusObservations
    models: tuple[EvaluatedModel, ...]
    effects: tuple[IdentifiedEffect, ...]
    confusable_effects: tuple[tuple[str, ...], ...]
    error_before: Mapping[str, RmsErrors]
    error_after: Mapping[str, RmsErrors]
    noise_floor: RmsErrors
    adequate_before: bool
    adequate_after: bool
    consistency_checks: tuple[ConsistencyCheck, ...]
    error_assumptions: tuple[ErrorAssumption, ...]
    static_checks: tuple[StaticCheck, ...]
    relaxation_floor: float
    seconds: float

    def model(self, role: Role) -> EvaluatedModel:
        """The first model of a role; raises KeyError where there is none."""
        for model in self.models:
            if model.role == role:
                return model
        raise KeyError(role)

    @property
    def reference_model(self) -> EvaluatedModel:
        """The reference: the declared rope, or where none is declared the best constant one."""
        return self.model("declared" if self.models[0].role == "declared" else "constant")

    @property
    def chosen_model(self) -> EvaluatedModel:
        """The model that was selected for the table."""
        return self.model("chosen")


def evaluate_model(
    observations: ModulusObservations,
    role: Role,
    label: str,
    material: Material,
    estimates: tuple[Estimate, ...] = (),
    cross_validation: CrossValidation | None = None,
) -> EvaluatedModel:
    """Evaluate a material on observations; ``estimates`` are of its fitted constants, empty for declared ones."""
    chi_squared = float(np.sum(whitened_residuals(observations, material) ** 2))
    degrees_of_freedom = observations.measurement_count - len(estimates)
    storage, viscous = _model_errors(observations, material)
    return EvaluatedModel(
        role=role,
        label=label,
        material=material,
        estimates=estimates,
        chi_squared=chi_squared,
        degrees_of_freedom=degrees_of_freedom,
        p_value=float(chi2.sf(chi_squared, degrees_of_freedom)),
        bic=chi_squared + len(estimates) * float(np.log(observations.measurement_count)),
        storage_residuals=storage / observations.storage_uncertainty,
        damping_residuals=viscous / observations.damping_uncertainty,
        cross_validation=cross_validation,
    )


def evaluate_fit(
    observations: ModulusObservations,
    role: Role,
    fit: MaterialFit,
    declared: Material | None = None,
    cross_validation: CrossValidation | None = None,
) -> EvaluatedModel:
    """Evaluate a fit, with its confidence intervals, on ``observations``; ``declared`` gives the present constants."""
    estimates = parameter_estimates(fit, declared)
    return evaluate_model(observations, role, fit.structure.label, fit.material, estimates, cross_validation)


def parameter_estimates(fit: MaterialFit, declared: Material | None) -> tuple[Estimate, ...]:
    """Estimates of all parameters of a fit with their 95 % intervals."""
    declared_values: Mapping[str, float] = (
        {"modulus": declared.modulus, "damping": declared.damping} if declared else {}
    )
    return tuple(
        Estimate(
            effect=parameter.effect,
            name=parameter.name,
            value=value,
            unit=parameter.unit,
            low=interval.low,
            high=interval.high,
            low_is_open=interval.low_is_open,
            high_is_open=interval.high_is_open,
            declared=declared_values.get(parameter.effect),
        )
        for parameter, value, interval in zip(
            fit.structure.parameters, fit.values, confidence_intervals(fit), strict=True
        )
    )


def fit_errors(observations: ModulusObservations, model: EvaluatedModel) -> RmsErrors:
    """Root mean square errors, model less measured, over the rows that the model was fitted to."""
    return _rms_errors(*_model_errors(observations, model.material))


def prediction_errors(observations: ModulusObservations, model: EvaluatedModel) -> RmsErrors:
    """Root mean square errors of cross-validated predictions; of a declared rope, never fitted, over all rows."""
    if model.cross_validation is None:
        return fit_errors(observations, model)
    return _rms_errors(
        model.cross_validation.storage - observations.storage, model.cross_validation.damping - observations.damping
    )


def noise_floor(observations: ModulusObservations) -> RmsErrors:
    """Root mean square errors that the table's uncertainties alone would give."""
    return _rms_errors(observations.storage_uncertainty, observations.damping_uncertainty)


def _rms_errors(storage: Array, viscous: Array) -> RmsErrors:
    return RmsErrors(float(np.sqrt(np.mean(storage**2))), float(np.sqrt(np.mean(viscous**2))))


def _model_errors(observations: ModulusObservations, material: Material) -> tuple[Array, Array]:
    """Model less measured: storage modulus (Pa) and damping (Pa s), each (N,)."""
    return (
        storage_modulus(material, observations.frequency, observations.amplitude) - observations.storage,
        viscous_damping(material, observations.frequency, observations.amplitude) - observations.damping,
    )
