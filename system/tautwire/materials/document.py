"""A verdict on a rope as the document that ``fit.json`` holds, in the style of a trace's ``report.json``."""

from __future__ import annotations

import math
from typing import Any

from .consistency import Check
from .robot_material import robot_material
from .verdict import Assumption, Errors, Estimate, FoundEffect, MaterialVerdict, Model, StaticCheck
from .wording import TITLES, notes, sentence


def material_document(verdict: MaterialVerdict) -> dict[str, Any]:
    """The verdict in plain types that JSON knows, SI units; null where a number is not finite."""
    rope = robot_material(verdict.model("robot").material)
    return {
        "verdict": verdict.verdict,
        "sentence": sentence(verdict),
        "table": verdict.table.path,
        "columns": list(verdict.pair),
        "effects": [_effect(effect) for effect in verdict.effects],
        "also_possible": [list(names) for names in verdict.also_possible],
        "formula": None,
        "error_before": {role: _errors(each) for role, each in verdict.error_before.items()},
        "error_after": {role: _errors(each) for role, each in verdict.error_after.items()},
        "noise_floor": _errors(verdict.noise_floor),
        "residual_is_noise": {"before": verdict.noise_before, "after": verdict.noise_after},
        "alpha": verdict.options.alpha,
        "shared": verdict.options.shared,
        "coverage": verdict.options.coverage,
        "rows": _rows(verdict),
        "models": [_model(model) for model in verdict.models],
        "relaxation_floor": verdict.floor,
        "other_readings": [_assumption(assumption) for assumption in verdict.assumptions],
        "static": [_static(check) for check in verdict.static_checks],
        "consistency": [_check(check) for check in verdict.checks],
        "robot": {
            "modulus": rope.modulus,
            "damping": rope.damping,
            "effect": {"relaxation": dict(rope.relaxation)} if rope.branches else {},
        },
        "notes": list(notes(verdict)),
        "seconds": verdict.seconds,
    }


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "cables": [],
        "parameters": {name: _estimate(estimate) for name, estimate in effect.parameters.items()},
        "component": "cable",
        "evidence": _number(effect.evidence),
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


def _errors(errors: Errors) -> dict[str, Any]:
    return {
        "storage_modulus_rms": _number(errors.storage_modulus_rms),
        "damping_rms": _number(errors.damping_rms),
    }


def _rows(verdict: MaterialVerdict) -> list[dict[str, Any]]:
    """What was measured, each number with one standard deviation."""
    seen = verdict.seen
    columns = (seen.frequency, seen.storage, seen.storage_uncertainty, seen.damping, seen.damping_uncertainty)
    names = ("frequency", "storage_modulus", "storage_modulus_uncertainty", "damping", "damping_uncertainty")
    return [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]


def _model(model: Model) -> dict[str, Any]:
    left_out = model.leave_out
    return {
        "role": model.role,
        "title": TITLES[model.role],
        "terms": model.label,
        "parameters": [
            {"effect": estimate.effect, "name": estimate.name, **_estimate(estimate)} for estimate in model.estimates
        ],
        "modulus": model.material.modulus,
        "damping": model.material.damping,
        "chi_squared": _number(model.chi_squared),
        "degrees_of_freedom": model.freedom,
        "p_value": _number(model.p_value),
        "bic": _number(model.bic),
        "storage_modulus_sigmas": [_number(value) for value in model.storage_sigmas],
        "damping_sigmas": [_number(value) for value in model.damping_sigmas],
        "leave_one_out": None
        if left_out is None
        else {
            "chi_squared": [_number(value) for value in left_out.chi_squared],
            "total": _number(left_out.total),
            "total_inside": _number(left_out.total_inside),
            "p_value_of_rest": [_number(fit.p_value) for fit in left_out.rest],
        },
    }


def _assumption(assumption: Assumption) -> dict[str, Any]:
    outcomes: dict[str, Any] = {
        role: {"chi_squared": _number(left), "degrees_of_freedom": freedom, "p_value": _number(p_value)}
        for role, (left, freedom, p_value) in assumption.outcomes.items()
    }
    return {"reading": assumption.label, **outcomes}


def _static(check: StaticCheck) -> dict[str, Any]:
    return {
        "model": check.role,
        "measured": check.measured,
        "uncertainty": check.uncertainty,
        "predicted": _estimate(check.predicted),
    }


def _check(check: Check) -> dict[str, Any]:
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
