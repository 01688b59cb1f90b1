"""The verdict on a rope as the JSON document ``fit.json``, in the style of a trace's ``report.json``."""

from __future__ import annotations

import math
from typing import Any

from .consistency import ConsistencyCheck
from .robot_material import robot_material
from .verdict import (
    ErrorAssumption,
    Estimate,
    EvaluatedModel,
    IdentifiedEffect,
    MaterialVerdict,
    RmsErrors,
    StaticCheck,
)
from .wording import MODEL_TITLES, verdict_notes, verdict_sentence


def material_document(verdict: MaterialVerdict) -> dict[str, Any]:
    """The verdict in plain JSON types, SI units; null where a number is not finite."""
    rope = robot_material(verdict.model("robot").material)
    return {
        "verdict": verdict.verdict,
        "sentence": verdict_sentence(verdict),
        "table": verdict.table.path,
        "columns": list(verdict.pair),
        "effects": [_effect(effect) for effect in verdict.effects],
        "also_possible": [list(names) for names in verdict.confusable_effects],
        "formula": None,
        "error_before": {role: _errors(each) for role, each in verdict.error_before.items()},
        "error_after": {role: _errors(each) for role, each in verdict.error_after.items()},
        "noise_floor": _errors(verdict.noise_floor),
        "residual_is_noise": {"before": verdict.adequate_before, "after": verdict.adequate_after},
        "alpha": verdict.options.significance_level,
        "shared": verdict.options.shared_variance,
        "coverage": verdict.options.coverage_factor,
        "rows": _rows(verdict),
        "models": [_model(model) for model in verdict.models],
        "relaxation_floor": verdict.relaxation_floor,
        "other_readings": [_assumption(assumption) for assumption in verdict.error_assumptions],
        "static": [_static(check) for check in verdict.static_checks],
        "consistency": [_check(check) for check in verdict.consistency_checks],
        "robot": {
            "modulus": rope.modulus,
            "damping": rope.damping,
            "effect": {"relaxation": dict(rope.relaxation)} if rope.branches else {},
        },
        "notes": list(verdict_notes(verdict)),
        "seconds": verdict.seconds,
    }


def _effect(effect: IdentifiedEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "cables": [],
        "parameters": {name: _estimate(estimate) for name, estimate in effect.parameters.items()},
        "component": "cable",
        "evidence": _number(effect.log_likelihood_ratio),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {
        "value": _number(estimate.value),
        "unit": estimate.unit,
        "low": _number(estimate.low),
        "high": _number(estimate.high),
        "low_is_open": estimate.low_is_open,
        "high_is_open": estimate.high_is_open,
        "declared": _number(estimate.declared),
    }


def _errors(errors: RmsErrors) -> dict[str, Any]:
    return {
        "storage_modulus_rms": _number(errors.storage_modulus_rms),
        "damping_rms": _number(errors.damping_rms),
    }


def _rows(verdict: MaterialVerdict) -> list[dict[str, Any]]:
    """Measured values of each row, with one standard deviation."""
    observations = verdict.observations
    columns = (
        observations.frequency,
        observations.storage,
        observations.storage_uncertainty,
        observations.damping,
        observations.damping_uncertainty,
    )
    names = ("frequency", "storage_modulus", "storage_modulus_uncertainty", "damping", "damping_uncertainty")
    return [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]


def _model(model: EvaluatedModel) -> dict[str, Any]:
    cross_validation = model.cross_validation
    return {
        "role": model.role,
        "title": MODEL_TITLES[model.role],
        "terms": model.label,
        "parameters": [
            {"effect": estimate.effect, "name": estimate.name, **_estimate(estimate)} for estimate in model.estimates
        ],
        "modulus": model.material.modulus,
        "damping": model.material.damping,
        "chi_squared": _number(model.chi_squared),
        "degrees_of_freedom": model.degrees_of_freedom,
        "p_value": _number(model.p_value),
        "bic": _number(model.bic),
        "storage_modulus_sigmas": [_number(value) for value in model.storage_residuals],
        "damping_sigmas": [_number(value) for value in model.damping_residuals],
        "leave_one_out": None
        if cross_validation is None
        else {
            "chi_squared": [_number(value) for value in cross_validation.chi_squared],
            "total": _number(cross_validation.total_chi_squared),
            "total_inside": _number(cross_validation.interpolated_chi_squared),
            "p_value_of_rest": [_number(fit.p_value) for fit in cross_validation.fits],
        },
    }


def _assumption(assumption: ErrorAssumption) -> dict[str, Any]:
    outcomes: dict[str, Any] = {
        role: {
            "chi_squared": _number(chi_squared),
            "degrees_of_freedom": degrees_of_freedom,
            "p_value": _number(p_value),
        }
        for role, (chi_squared, degrees_of_freedom, p_value) in assumption.outcomes.items()
    }
    return {"reading": assumption.label, **outcomes}


def _static(check: StaticCheck) -> dict[str, Any]:
    return {
        "model": check.role,
        "measured": check.measured,
        "uncertainty": check.uncertainty,
        "predicted": _estimate(check.predicted),
    }


def _check(check: ConsistencyCheck) -> dict[str, Any]:
    return {
        "frequency": check.frequency,
        "column": check.column,
        "formula": check.formula,
        "written": check.written,
        "recomputed": check.recomputed,
        "low": check.low,
        "high": check.high,
        "uncertainty": check.uncertainty,
        "written_uncertainty": check.written_uncertainty,
        "agreement": check.agreement,
    }


def _number(value: float | None) -> float | None:
    """A plain float; None where it is none or not finite."""
    return None if value is None or not math.isfinite(value) else float(value)
