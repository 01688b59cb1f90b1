"""Goodness of fit of models against a table, row by row."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from .fit import MaterialFit, whitened_residuals
from .leave_out import CrossValidation
from .modulus import Material, storage_modulus, viscous_damping
from .observations import ModulusObservations
from .profile import confidence_intervals
from .verdict import Estimate, EvaluatedModel, RmsErrors, Role


def declared_model(observations: ModulusObservations, material: Material) -> EvaluatedModel:
    """Evaluate a material whose constants were not fitted."""
    chi_squared = float(np.sum(whitened_residuals(observations, material) ** 2))
    count = observations.measurement_count
    return _evaluate_model(observations, "declared", "damping", material, (), chi_squared, count, chi_squared)


def fitted_model(
    observations: ModulusObservations,
    role: Role,
    fit: MaterialFit,
    declared: Material | None = None,
    cross_validation: CrossValidation | None = None,
) -> EvaluatedModel:
    """Evaluate a fit, with its confidence intervals, on ``observations``; ``declared`` gives the present constants."""
    estimates = parameter_estimates(fit, declared)
    chi_squared = float(np.sum(whitened_residuals(observations, fit.material) ** 2))
    degrees_of_freedom = observations.measurement_count - len(fit.values)
    bic = chi_squared + len(fit.values) * float(np.log(observations.measurement_count))
    return _evaluate_model(
        observations,
        role,
        fit.structure.label,
        fit.material,
        estimates,
        chi_squared,
        degrees_of_freedom,
        bic,
        cross_validation,
    )


def parameter_estimates(fit: MaterialFit, declared: Material | None) -> tuple[Estimate, ...]:
    """Estimates of all parameters of a fit with their 95 % intervals."""
    declared_values: Mapping[str, float] = (
        {"modulus": declared.modulus, "damping": declared.damping} if declared else {}
    )
    return tuple(
        Estimate(
            effect=parameter.effect,
            name=parameter.name,
            unit=parameter.unit,
            value=value,
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
    return _rms_errors(
        storage_modulus(model.material, observations.frequency, observations.amplitude) - observations.storage,
        viscous_damping(model.material, observations.frequency, observations.amplitude) - observations.damping,
    )


def prediction_errors(observations: ModulusObservations, model: EvaluatedModel) -> RmsErrors:
    """Root mean square errors of cross-validated predictions; of a declared pair, never fitted, over all rows."""
    if model.cross_validation is None:
        return fit_errors(observations, model)
    return _rms_errors(
        model.cross_validation.storage - observations.storage, model.cross_validation.damping - observations.damping
    )


def noise_floor(observations: ModulusObservations) -> RmsErrors:
    """Root mean square errors that the table's uncertainties alone would give."""
    return _rms_errors(observations.storage_uncertainty, observations.damping_uncertainty)


def _rms_errors(storage: np.ndarray, viscous: np.ndarray) -> RmsErrors:
    return RmsErrors(float(np.sqrt(np.mean(storage**2))), float(np.sqrt(np.mean(viscous**2))))


def _evaluate_model(
    observations: ModulusObservations,
    role: Role,
    label: str,
    material: Material,
    estimates: tuple[Estimate, ...],
    chi_squared: float,
    degrees_of_freedom: int,
    bic: float,
    cross_validation: CrossValidation | None = None,
) -> EvaluatedModel:
    storage = storage_modulus(material, observations.frequency, observations.amplitude) - observations.storage
    viscous = viscous_damping(material, observations.frequency, observations.amplitude) - observations.damping
    return EvaluatedModel(
        role=role,
        label=label,
        material=material,
        estimates=estimates,
        chi_squared=chi_squared,
        degrees_of_freedom=degrees_of_freedom,
        p_value=float(chi2.sf(chi_squared, degrees_of_freedom)),
        bic=bic,
        storage_residuals=storage / observations.storage_uncertainty,
        damping_residuals=viscous / observations.damping_uncertainty,
        cross_validation=cross_validation,
    )
