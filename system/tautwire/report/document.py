"""A trace as the document that ``report.json`` holds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from ..runs.wiring import AXES
from ..tracer.verdict import Candidate, Correlation, Detectable, Errors, Estimate, FoundEffect, Likeness, Trace
from ..tracer.where.port_residuals import ComponentResidual
from .summary import ROLES, comparison_of


def trace_document(trace: Trace) -> dict[str, Any]:
    """The report in plain types that JSON knows, keys in a fixed order; null where a number is not finite."""
    return {
        "verdict": trace.verdict,
        "sentence": trace.sentence,
        "robot": trace.robot_before.name,
        "effects": [_effect(effect) for effect in trace.effects],
        "correlations": [_correlation(each) for each in trace.correlations],
        "also_possible": [list(names) for names in trace.also_possible],
        "formula": trace.formula,
        "error_before": _errors_of_roles(trace, "errors_before"),
        "error_after": _errors_of_roles(trace, "errors_after"),
        "noise_floor": _errors(trace.noise_floor, trace.robot_before.cable_count),
        "residual_is_noise": {"before": bool(trace.noise_before), "after": bool(trace.noise_after)},
        "left": _by_output(trace, trace.left),
        "autocorrelation": _by_output(trace, trace.autocorrelations[0]),
        "autocorrelation_of_noise": _by_output(trace, trace.autocorrelations[1]),
        "detectable": [_detectable(each) for each in trace.separation.detectable],
        "alike": [_likeness(each) for each in trace.separation.alike],
        "components": [_component(part) for part in trace.components.ranking],
        "where": {
            "component": trace.components.blamed,
            "sentence": trace.components.sentence,
            "untold": list(trace.components.untold),
        },
        "resonance": [
            {"frequency_hz": _number(each.frequency), "outputs": list(each.outputs), "on": list(each.on)}
            for each in trace.resonances
        ],
        "alpha": _number(trace.alpha),
        "candidates": [_candidate(candidate) for candidate in trace.candidates],
        "unknown_columns": _unknown_columns(trace),
        "notes": list(trace.notes),
        "seconds": _number(trace.seconds),
    }


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "cables": _whole(effect.cables),
        "parameters": {name: _estimate(estimate) for name, estimate in effect.parameters.items()},
        "component": effect.component,
        "evidence": _number(effect.evidence),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {
        "value": _number(estimate.value),
        "unit": estimate.unit,
        "low": _number(estimate.low),
        "high": _number(estimate.high),
        "declared": _number(estimate.declared),
    }


def _correlation(correlation: Correlation) -> dict[str, Any]:
    between = [
        {"name": each.name, "cables": _whole(each.cables), "parameter": each.parameter} for each in correlation.between
    ]
    return {"between": between, "value": _number(correlation.value)}


def _component(part: ComponentResidual) -> dict[str, Any]:
    moved = part.moves_with
    return {
        "component": part.component,
        "quantity": part.quantity,
        "unit": part.unit,
        "rms": _number(part.rms),
        "expected_rms": _number(part.expected_rms),
        "ratio": _number(part.ratio),
        "limit": _number(part.limit),
        "mean": _number(part.mean),
        "moves_with": {"name": moved.name, "correlation": _number(moved.correlation)} if moved else None,
        "rings_at_hz": _number(part.rings_at),
    }


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "round": int(candidate.round),
        "name": candidate.name,
        "cables": _whole(candidate.cables),
        "values": {name: _number(value) for name, value in candidate.values.items()},
        "evidence": _number(candidate.evidence),
        "mean_square": _number(candidate.mean_square),
        "accepted": bool(candidate.accepted),
    }


def _detectable(size: Detectable) -> dict[str, Any]:
    return {
        "name": size.name,
        "cables": _whole(size.cables),
        "parameter": size.parameter,
        "size": _number(size.size),
        "unit": size.unit,
        "beside": {name: _number(value) for name, value in size.beside.items()},
    }


def _likeness(likeness: Likeness) -> dict[str, Any]:
    return {
        "name": likeness.name,
        "cables": _whole(likeness.cables),
        "other": likeness.other,
        "other_cables": _whole(likeness.other_cables),
        "cosine": _number(likeness.cosine),
        "nats": _number(likeness.nats),
    }


def _errors_of_roles(trace: Trace, field: str) -> dict[str, Any]:
    found = {role: comparison_of(trace, role) for role in ROLES}
    count = trace.robot_before.cable_count
    return {role: _errors(getattr(each, field) if each else None, count) for role, each in found.items()}


def _errors(errors: Errors | None, cable_count: int) -> dict[str, Any]:
    """Errors in m and N; all null where there are none."""
    axes: Iterable[float] = errors.axes if errors else [math.nan] * len(AXES)
    cables: Iterable[float] = errors.cables if errors else [math.nan] * cable_count
    return {
        "position_rms": _number(errors.position_rms if errors else None),
        "tension_rms": _number(errors.tension_rms if errors else None),
        "axes": {axis: _number(value) for axis, value in zip(AXES, axes, strict=True)},
        "cables": [_number(value) for value in cables],
    }


def _by_output(trace: Trace, values: Iterable[float]) -> dict[str, float | None]:
    names = [*AXES, *(f"tension_{cable}" for cable in trace.robot_before.cable_numbers)]
    return {name: _number(value) for name, value in zip(names, values, strict=True)}


def _unknown_columns(trace: Trace) -> dict[str, list[str]]:
    return {each.role: list(each.recording.unknown_columns) for each in trace.comparisons}


def _whole(numbers: Iterable[int]) -> list[int]:
    return [int(number) for number in numbers]


def _number(value: float | None) -> float | None:
    """A plain float; None where it is none or not finite."""
    return None if value is None or not math.isfinite(value) else float(value)
