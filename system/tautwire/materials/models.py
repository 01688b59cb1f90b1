"""Models beside a table: how far each is off, row by row."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from .fit import MaterialFit, residuals
from .leave_out import LeaveOut
from .modulus import Material, damping, storage_modulus
from .observations import Observations
from .profile import intervals
from .verdict import Errors, Estimate, Model, Role


def declared_model(seen: Observations, material: Material) -> Model:
    """A material whose constants were not fitted."""
    chi_squared = float(np.sum(residuals(seen, material) ** 2))
    count = seen.number_count
    return _model(seen, "declared", "damping", material, (), chi_squared, count, chi_squared)


def fitted_model(
    seen: Observations,
    role: Role,
    fit: MaterialFit,
    declared: Material | None = None,
    left_out: LeaveOut | None = None,
) -> Model:
    """A fit with the intervals of its parameters, judged on ``seen``; ``declared`` gives the constants so far."""
    found = estimates(fit, declared)
    chi_squared = float(np.sum(residuals(seen, fit.material) ** 2))
    freedom = seen.number_count - len(fit.values)
    bic = chi_squared + len(fit.values) * float(np.log(seen.number_count))
    return _model(seen, role, fit.terms.label, fit.material, found, chi_squared, freedom, bic, left_out)


def estimates(fit: MaterialFit, declared: Material | None) -> tuple[Estimate, ...]:
    """Every parameter of a fit with its 95 % interval."""
    known: Mapping[str, float] = {"modulus": declared.modulus, "damping": declared.damping} if declared else {}
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
            declared=known.get(parameter.effect),
        )
        for parameter, value, interval in zip(fit.terms.parameters, fit.values, intervals(fit), strict=True)
    )


def errors(seen: Observations, model: Model) -> Errors:
    """Root mean squares of model less measured, over the rows that it was fitted to."""
    return _rms(
        storage_modulus(model.material, seen.frequency, seen.amplitude) - seen.storage,
        damping(model.material, seen.frequency, seen.amplitude) - seen.damping,
    )


def predicted_errors(seen: Observations, model: Model) -> Errors:
    """The same over rows predicted from the others; of a declared pair, which saw none, over all."""
    if model.leave_out is None:
        return errors(seen, model)
    return _rms(model.leave_out.storage - seen.storage, model.leave_out.damping - seen.damping)


def noise_floor(seen: Observations) -> Errors:
    """What the table's uncertainties alone would leave."""
    return _rms(seen.storage_uncertainty, seen.damping_uncertainty)


def _rms(storage: np.ndarray, viscous: np.ndarray) -> Errors:
    return Errors(float(np.sqrt(np.mean(storage**2))), float(np.sqrt(np.mean(viscous**2))))


def _model(
    seen: Observations,
    role: Role,
    label: str,
    material: Material,
    found: tuple[Estimate, ...],
    chi_squared: float,
    freedom: int,
    bic: float,
    left_out: LeaveOut | None = None,
) -> Model:
    storage = storage_modulus(material, seen.frequency, seen.amplitude) - seen.storage
    viscous = damping(material, seen.frequency, seen.amplitude) - seen.damping
    return Model(
        role=role,
        label=label,
        material=material,
        estimates=found,
        chi_squared=chi_squared,
        freedom=freedom,
        p_value=float(chi2.sf(chi_squared, freedom)),
        bic=bic,
        storage_sigmas=storage / seen.storage_uncertainty,
        damping_sigmas=viscous / seen.damping_uncertainty,
        leave_out=left_out,
    )
