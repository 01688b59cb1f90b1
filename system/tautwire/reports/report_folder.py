"""The report folder of a trace: the robot with its effects, its FMUs, ``report.json``, residuals and an HTML page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..estimation.disturbance import Disturbance
from ..estimation.localisation.component_residuals import ComponentResidual
from ..estimation.measured_outputs import output_names
from ..estimation.trace_result import Detectable, Errors, FoundEffect, Trace
from ..fmus.packaging import RobotFmus, build_fmus, with_user_fmus_copied
from ..json_document import json_value, write_json
from ..provenance import Provenance, provenance_of
from ..recordings.recording import Recording
from ..robot.robot_file_writer import write_robot
from ..robot.schema import AXES, Robot
from ..validation import validate_folder, validate_instance
from .residual_file import RESIDUAL_FILE, write_residuals
from .trace_report_page import trace_page
from .trace_texts import ROLES, comparison_by_role


def trace_document(trace: Trace) -> dict[str, Any]:
    """The report in JSON types, keys in a fixed order; None where a number is not finite."""
    components = trace.components
    document = {
        "verdict": trace.verdict,
        "sentence": trace.sentence,
        "robot": trace.robot_before.name,
        "effects": [_effect(effect) for effect in trace.effects],
        "small_effects": [_effect(effect) for effect in trace.small_effects],
        "left_share": trace.left_share,
        "disturbance": _disturbance(trace.disturbance, trace.comparisons[0].recording),
        "correlations": [asdict(each) for each in trace.correlations],
        "also_possible": trace.also_possible,
        "formula": trace.formula,
        "error_before": _errors_by_role(trace, "errors_before"),
        "error_after": _errors_by_role(trace, "errors_after"),
        "noise_floor": _errors(trace.noise_floor, trace.robot_before),
        "residual_is_noise": {"before": trace.noise_before, "after": trace.noise_after},
        "left": _by_output(trace, trace.normalised_innovation_variance),
        "autocorrelation": _by_output(trace, trace.autocorrelations[0]),
        "autocorrelation_of_noise": _by_output(trace, trace.autocorrelations[1]),
        "detectable": [_detectable(each) for each in trace.identifiability.detectable],
        "alike": [asdict(each) for each in trace.identifiability.confusable],
        "components": [_component(part) for part in components.ranking],
        "where": {
            "component": components.faulty_component,
            "sentence": components.sentence,
            "untold": components.limitations,
        },
        "resonance": [
            {"frequency_hz": each.frequency, "outputs": each.outputs, "on": each.on} for each in trace.resonances
        ],
        "alpha": trace.alpha,
        "candidates": [asdict(candidate) for candidate in trace.candidates],
        "unknown_columns": {each.role: each.recording.unknown_columns for each in trace.comparisons},
        "untried": trace.untried,
        "notes": trace.notes,
        "seconds": trace.seconds,
    }
    return dict(json_value(document))


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "cables": effect.cables,
        "parameters": {name: asdict(estimate) for name, estimate in effect.parameters.items()},
        "component": effect.component,
        "evidence": effect.evidence,
        "share": effect.share,
    }


def _disturbance(disturbance: Disturbance | None, recording: Recording) -> dict[str, Any]:
    """What had to be assumed beside noise; None where nothing had, and of sensors that the robot does not have."""
    processes = {
        "force": disturbance.force if disturbance else None,
        "tension": disturbance.tension if disturbance and recording.has_tension else None,
        "position": disturbance.position if disturbance and recording.has_position else None,
    }
    if recording.has_orientation:
        processes["orientation"] = disturbance.rotation if disturbance else None
    sizes = {f"{name}_rms": process.rms if process else None for name, process in processes.items()}
    force, *others = ((name, process.bandwidth if process else None) for name, process in processes.items())
    return {**sizes, "bandwidth_hz": force[1], **{f"{name}_bandwidth_hz": bandwidth for name, bandwidth in others}}


def _component(part: ComponentResidual) -> dict[str, Any]:
    association = part.correlated_signal
    return {
        "component": part.component,
        "quantity": part.quantity,
        "unit": part.unit,
        "rms": part.rms,
        "expected_rms": part.expected_rms,
        "ratio": part.ratio,
        "limit": part.threshold,
        "mean": part.mean,
        "moves_with": {"name": association.name, "correlation": association.correlation} if association else None,
        "rings_at_hz": part.resonance_frequency,
    }


def _detectable(size: Detectable) -> dict[str, Any]:
    fields = asdict(size)
    other_values = fields.pop("other_values")
    return {**fields, "beside": other_values}


def _errors_by_role(trace: Trace, field: str) -> dict[str, Any]:
    comparisons = {role: comparison_by_role(trace, role) for role in ROLES}
    robot = trace.robot_before
    return {role: _errors(getattr(each, field) if each else None, robot) for role, each in comparisons.items()}


def _errors(errors: Errors | None, robot: Robot) -> dict[str, Any]:
    """Root mean square errors in m, N and rad; all None where ``errors`` is None, without rad for a point mass."""
    absent = np.full(len(AXES), np.nan)
    errors = errors or Errors(np.nan, np.nan, absent, np.full(robot.cable_count, np.nan), rotations=absent)
    turning = (
        {"orientation_rms": errors.orientation_rms, "rotations": dict(zip(AXES, errors.rotations, strict=True))}
        if robot.platform.is_rigid_body
        else {}
    )
    return turning | {
        "position_rms": errors.position_rms,
        "tension_rms": errors.tension_rms,
        "axes": dict(zip(AXES, errors.axes, strict=True)),
        "cables": errors.cables,
    }


def _by_output(trace: Trace, values: Iterable[float]) -> dict[str, float]:
    names = output_names(trace.robot_before.cable_count, trace.robot_before.platform.is_rigid_body)
    return dict(zip(names, values, strict=True))


def write_report(
    trace: Trace, folder: str | Path, provenance: Provenance | None = None, robot_file: str | Path | None = None
) -> RobotFmus:
    """Writes ``robot.toml``, its FMUs, ``report.json``, ``residuals.parquet`` and ``index.html`` into a folder.

    The folder is created if absent. ``robot_file`` is the file that the robot was read from: ``robot.toml`` keeps
    its comments and order. Without ``provenance`` the files tell version and date.

    Returns the paths of the FMUs. Raises ArgumentError where ``trace`` is not what :func:`tautwire.trace` returns or
    ``folder`` names none, OSError where the disk refuses.
    """
    validate_instance("write_report: trace", trace, Trace, "give what trace returns")
    folder = validate_folder("write_report: folder", folder)
    folder.mkdir(parents=True, exist_ok=True)
    provenance = provenance or provenance_of()
    write_robot(trace.robot_after, folder / "robot.toml", provenance, robot_file)
    fmus = with_user_fmus_copied(build_fmus(trace.robot_after, folder), folder)
    write_json(folder / "report.json", {**trace_document(trace), "provenance": provenance.document()})
    write_residuals(trace, folder / RESIDUAL_FILE, provenance)
    links = {name: name for name in ("robot.toml", "report.json", RESIDUAL_FILE)}
    links |= {path.name: path.name for path in fmus.paths}
    (folder / "index.html").write_text(trace_page(trace, links, provenance), encoding="utf-8")
    return fmus
