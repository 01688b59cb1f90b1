"""The report folder of a trace: the robot with its effects, its FMUs, ``report.json`` and an HTML page."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..cosimulation.robot_wiring import AXES
from ..estimation.localisation.component_residuals import ComponentResidual
from ..estimation.trace_result import (
    Candidate,
    ConfusableEffect,
    Correlation,
    Detectable,
    Errors,
    Estimate,
    FoundEffect,
    Trace,
)
from ..fmus.packaging import RobotFmus, build_fmus, with_user_fmus_copied
from ..robot.robot_file_reader import write_robot
from ..validation import validate_folder, validate_instance
from .trace_report_page import trace_page
from .trace_texts import ROLES, comparison_by_role


def trace_document(trace: Trace) -> dict[str, Any]:
    """The report in JSON types, keys in a fixed order; None where a number is not finite."""
    return {
        "verdict": trace.verdict,
        "sentence": trace.sentence,
        "robot": trace.robot_before.name,
        "effects": [_effect(effect) for effect in trace.effects],
        "correlations": [_correlation(each) for each in trace.correlations],
        "also_possible": [list(names) for names in trace.also_possible],
        "formula": trace.formula,
        "error_before": _errors_by_role(trace, "errors_before"),
        "error_after": _errors_by_role(trace, "errors_after"),
        "noise_floor": _errors(trace.noise_floor, trace.robot_before.cable_count),
        "residual_is_noise": {"before": bool(trace.noise_before), "after": bool(trace.noise_after)},
        "left": _by_output(trace, trace.normalised_innovation_variance),
        "autocorrelation": _by_output(trace, trace.autocorrelations[0]),
        "autocorrelation_of_noise": _by_output(trace, trace.autocorrelations[1]),
        "detectable": [_detectable(each) for each in trace.identifiability.detectable],
        "alike": [_likeness(each) for each in trace.identifiability.confusable],
        "components": [_component(part) for part in trace.components.ranking],
        "where": {
            "component": trace.components.faulty_component,
            "sentence": trace.components.sentence,
            "untold": list(trace.components.limitations),
        },
        "resonance": [
            {"frequency_hz": _finite_or_none(each.frequency), "outputs": list(each.outputs), "on": list(each.on)}
            for each in trace.resonances
        ],
        "alpha": _finite_or_none(trace.alpha),
        "candidates": [_candidate(candidate) for candidate in trace.candidates],
        "unknown_columns": _unknown_columns(trace),
        "notes": list(trace.notes),
        "seconds": _finite_or_none(trace.seconds),
    }


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "cables": _integers(effect.cables),
        "parameters": {name: _estimate(estimate) for name, estimate in effect.parameters.items()},
        "component": effect.component,
        "evidence": _finite_or_none(effect.evidence),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {
        "value": _finite_or_none(estimate.value),
        "unit": estimate.unit,
        "low": _finite_or_none(estimate.low),
        "high": _finite_or_none(estimate.high),
        "declared": _finite_or_none(estimate.declared),
    }


def _correlation(correlation: Correlation) -> dict[str, Any]:
    between = [
        {"name": each.name, "cables": _integers(each.cables), "parameter": each.parameter}
        for each in correlation.between
    ]
    return {"between": between, "value": _finite_or_none(correlation.value)}


def _component(part: ComponentResidual) -> dict[str, Any]:
    association = part.correlated_signal
    return {
        "component": part.component,
        "quantity": part.quantity,
        "unit": part.unit,
        "rms": _finite_or_none(part.rms),
        "expected_rms": _finite_or_none(part.expected_rms),
        "ratio": _finite_or_none(part.ratio),
        "limit": _finite_or_none(part.threshold),
        "mean": _finite_or_none(part.mean),
        "moves_with": {"name": association.name, "correlation": _finite_or_none(association.correlation)}
        if association
        else None,
        "rings_at_hz": _finite_or_none(part.resonance_frequency),
    }


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "round": int(candidate.round),
        "name": candidate.name,
        "cables": _integers(candidate.cables),
        "values": {name: _finite_or_none(value) for name, value in candidate.values.items()},
        "evidence": _finite_or_none(candidate.evidence),
        "mean_square": _finite_or_none(candidate.mean_square),
        "accepted": bool(candidate.accepted),
    }


def _detectable(size: Detectable) -> dict[str, Any]:
    return {
        "name": size.name,
        "cables": _integers(size.cables),
        "parameter": size.parameter,
        "size": _finite_or_none(size.size),
        "unit": size.unit,
        "beside": {name: _finite_or_none(value) for name, value in size.other_values.items()},
    }


def _likeness(likeness: ConfusableEffect) -> dict[str, Any]:
    return {
        "name": likeness.name,
        "cables": _integers(likeness.cables),
        "other": likeness.other,
        "other_cables": _integers(likeness.other_cables),
        "cosine": _finite_or_none(likeness.cosine),
        "nats": _finite_or_none(likeness.nats),
    }


def _errors_by_role(trace: Trace, field: str) -> dict[str, Any]:
    comparisons = {role: comparison_by_role(trace, role) for role in ROLES}
    count = trace.robot_before.cable_count
    return {role: _errors(getattr(each, field) if each else None, count) for role, each in comparisons.items()}


def _errors(errors: Errors | None, cable_count: int) -> dict[str, Any]:
    """Root mean square errors in m and N; all None where ``errors`` is None."""
    axes: Iterable[float] = errors.axes if errors else [math.nan] * len(AXES)
    cables: Iterable[float] = errors.cables if errors else [math.nan] * cable_count
    return {
        "position_rms": _finite_or_none(errors.position_rms if errors else None),
        "tension_rms": _finite_or_none(errors.tension_rms if errors else None),
        "axes": {axis: _finite_or_none(value) for axis, value in zip(AXES, axes, strict=True)},
        "cables": [_finite_or_none(value) for value in cables],
    }


def _by_output(trace: Trace, values: Iterable[float]) -> dict[str, float | None]:
    names = [*AXES, *(f"tension_{cable}" for cable in trace.robot_before.cable_numbers)]
    return {name: _finite_or_none(value) for name, value in zip(names, values, strict=True)}


def _unknown_columns(trace: Trace) -> dict[str, list[str]]:
    return {each.role: list(each.recording.unknown_columns) for each in trace.comparisons}


def _integers(numbers: Iterable[int]) -> list[int]:
    return [int(number) for number in numbers]


def _finite_or_none(value: float | None) -> float | None:
    """A plain float; None where the value is None or not finite."""
    return None if value is None or not math.isfinite(value) else float(value)


def write_report(trace: Trace, folder: str | Path) -> RobotFmus:
    """Writes ``robot.toml``, its FMUs, ``report.json`` and ``index.html`` into a folder, which is created if absent.

    Returns the paths of the FMUs. Raises ArgumentError where ``trace`` is not what :func:`tautwire.trace` returns or
    ``folder`` names none, OSError where the disk refuses.
    """
    validate_instance("write_report: trace", trace, Trace, "give what trace returns")
    folder = validate_folder("write_report: folder", folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_robot(trace.robot_after, folder / "robot.toml")
    fmus = with_user_fmus_copied(build_fmus(trace.robot_after, folder), folder)
    document = json.dumps(trace_document(trace), indent=1, allow_nan=False)
    (folder / "report.json").write_text(document + "\n", encoding="utf-8")
    links = {"robot.toml": "robot.toml", "report.json": "report.json"}
    links |= {path.name: path.name for path in fmus.paths}
    (folder / "index.html").write_text(trace_page(trace, links), encoding="utf-8")
    return fmus
