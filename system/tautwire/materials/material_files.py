"""Writes the files of a verdict on a rope: ``fit.json``, the figure, and the lines for a robot file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..json_document import write_json
from ..provenance import Provenance, provenance_of
from ..robot.robot_file_writer import write_robot
from ..robot.schema import Robot
from .material_report import GIGA, MODEL_TITLES, verdict_notes, verdict_sentence
from .material_verdict import (
    ErrorAssumption,
    Estimate,
    EvaluatedModel,
    IdentifiedEffect,
    MaterialVerdict,
    Role,
    StaticCheck,
)
from .model_selection import CrossValidation
from .modulus_observations import ModulusObservations
from .robot_material import RobotMaterial, robot_material, with_material
from .viscoelastic_model import storage_modulus, viscous_damping

CURVE_POINTS = 400
LINE_STYLES: dict[Role, tuple[str, str]] = {
    "declared": ("#999999", ":"),
    "constant": ("#d55e00", "--"),
    "relaxation": ("#0072b2", "-"),
    "chosen": ("#009e73", "-"),
}
MATERIAL_FILES = ("fit.json", "material.png", "material.svg", "relaxation.toml", "robot.toml")
DOTS_PER_INCH = 150


def fitted_rope(verdict: MaterialVerdict) -> RobotMaterial:
    """The fitted rope as a robot file holds it."""
    model = verdict.model("robot")
    return robot_material(model.material, model.estimates)


def material_document(verdict: MaterialVerdict) -> dict[str, Any]:
    """The verdict in plain types, SI units."""
    rope = fitted_rope(verdict)
    return {
        "verdict": verdict.verdict,
        "sentence": verdict_sentence(verdict),
        "table": verdict.table.path,
        "columns": list(verdict.pair),
        "effects": [_effect(effect) for effect in verdict.effects],
        "also_possible": [list(names) for names in verdict.confusable_effects],
        "formula": None,
        "error_before": {role: asdict(each) for role, each in verdict.error_before.items()},
        "error_after": {role: asdict(each) for role, each in verdict.error_after.items()},
        "noise_floor": asdict(verdict.noise_floor),
        "residual_is_noise": {"before": verdict.adequate_before, "after": verdict.adequate_after},
        "alpha": verdict.options.significance_level,
        "shared": verdict.options.shared_variance,
        "coverage": verdict.options.coverage_factor,
        "rows": _rows(verdict.observations),
        "models": [_model(model) for model in verdict.models],
        "relaxation_floor": verdict.relaxation_floor,
        "other_readings": [_assumption(assumption) for assumption in verdict.error_assumptions],
        "static": [_static(check) for check in verdict.static_checks],
        "consistency": [_fields(check, "range_gap") for check in verdict.consistency_checks],
        "robot": {
            "modulus": rope.modulus,
            "damping": rope.damping,
            "modulus_uncertainty": rope.modulus_uncertainty,
            "damping_uncertainty": rope.damping_uncertainty,
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
        "evidence": effect.log_likelihood_ratio,
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return _fields(estimate, "effect", "name")


def _fields(record: Any, *omitted: str) -> dict[str, Any]:
    """The fields of a dataclass by name, without those that are omitted."""
    return {name: value for name, value in asdict(record).items() if name not in omitted}


def _rows(observations: ModulusObservations) -> list[dict[str, float]]:
    """Measured values of each row, with one standard deviation."""
    columns = {
        "frequency": observations.frequency,
        "storage_modulus": observations.storage,
        "storage_modulus_uncertainty": observations.storage_uncertainty,
        "damping": observations.damping,
        "damping_uncertainty": observations.damping_uncertainty,
    }
    return [dict(zip(columns, row, strict=True)) for row in np.column_stack([*columns.values()]).tolist()]


def _model(model: EvaluatedModel) -> dict[str, Any]:
    return {
        "role": model.role,
        "title": MODEL_TITLES[model.role],
        "terms": model.label,
        "parameters": [asdict(estimate) for estimate in model.estimates],
        "modulus": model.material.modulus,
        "damping": model.material.damping,
        "chi_squared": model.chi_squared,
        "degrees_of_freedom": model.degrees_of_freedom,
        "p_value": model.p_value,
        "bic": model.bic,
        "storage_modulus_sigmas": model.storage_residuals.tolist(),
        "damping_sigmas": model.damping_residuals.tolist(),
        "leave_one_out": model.cross_validation and _cross_validation(model.cross_validation),
    }


def _cross_validation(cross_validation: CrossValidation) -> dict[str, Any]:
    return {
        "chi_squared": cross_validation.chi_squared.tolist(),
        "total": cross_validation.total_chi_squared,
        "total_inside": cross_validation.interpolated_chi_squared,
        "p_value_of_rest": [fit.p_value for fit in cross_validation.fits],
    }


def _assumption(assumption: ErrorAssumption) -> dict[str, Any]:
    return {"reading": assumption.label, **{role: each._asdict() for role, each in assumption.outcomes.items()}}


def _static(check: StaticCheck) -> dict[str, Any]:
    return {"model": check.role, **_fields(check, "role"), "predicted": _estimate(check.predicted)}


def material_figure(verdict: MaterialVerdict) -> Figure:
    """Plot E' and c against frequency with error bars of one sigma, and below them each model's residuals in sigmas."""
    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, height_ratios=[2.0, 1.0])
    models = _drawn_models(verdict)
    _draw_values(axes[0, 0], axes[0, 1], verdict, models)
    _draw_residuals(axes[1, 0], [(model, model.storage_residuals) for model in models], verdict)
    _draw_residuals(axes[1, 1], [(model, model.damping_residuals) for model in models], verdict)
    figure.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _drawn_models(verdict: MaterialVerdict) -> list[EvaluatedModel]:
    """Models to draw, one of each role that has a style; relaxation alone only once where it is the chosen one."""
    candidates = [model for model in verdict.models if model.role in LINE_STYLES]
    chosen = verdict.chosen_model.material
    return [model for model in candidates if model.role in ("declared", "chosen") or model.material != chosen]


def _draw_values(storage: Axes, viscous: Axes, verdict: MaterialVerdict, models: list[EvaluatedModel]) -> None:
    observations = verdict.observations
    frequency = np.geomspace(observations.frequency.min() / 2.0, observations.frequency.max() * 2.0, CURVE_POINTS)
    amplitude = _interpolated_amplitude(verdict, frequency)
    for model in models:
        colour, line = LINE_STYLES[model.role]
        label = f"{MODEL_TITLES[model.role]}: {model.label}, $\\chi^2$ = {model.chi_squared:.4g}"
        curve = storage_modulus(model.material, frequency, amplitude)
        storage.plot(frequency, curve / GIGA, line, color=colour)
        curve = viscous_damping(model.material, frequency, amplitude)
        viscous.plot(frequency, curve / GIGA, line, color=colour, label=label)
    for axes, measured, sigma in (
        (storage, observations.storage, observations.storage_uncertainty),
        (viscous, observations.damping, observations.damping_uncertainty),
    ):
        axes.errorbar(
            observations.frequency,
            measured / GIGA,
            sigma / GIGA,
            fmt="o",
            color="black",
            capsize=3.0,
            markersize=4.0,
            zorder=5,
            label="measured, one sigma",
        )
    storage.set_ylabel("storage modulus E' (GPa)")
    viscous.set_ylabel("damping c (GPa s)")
    storage.set_xscale("log")
    viscous.set_yscale("log")


def _interpolated_amplitude(verdict: MaterialVerdict, frequency: np.ndarray) -> np.ndarray:
    """Strain amplitude at frequencies between the rows, log-interpolated; constant beyond the end rows."""
    observations = verdict.observations
    if not observations.has_amplitude:
        return np.full_like(frequency, np.inf)
    order = np.argsort(observations.frequency)
    log_points = np.log(observations.frequency[order]), np.log(observations.amplitude[order])
    amplitude: np.ndarray = np.exp(np.interp(np.log(frequency), *log_points))
    return amplitude


def _draw_residuals(
    axes: Axes, residuals_by_model: list[tuple[EvaluatedModel, np.ndarray]], verdict: MaterialVerdict
) -> None:
    axes.axhspan(-1.0, 1.0, color="0.92")
    for model, residuals in residuals_by_model:
        colour, line = LINE_STYLES[model.role]
        order = np.argsort(verdict.observations.frequency)
        axes.plot(
            verdict.observations.frequency[order], residuals[order], line, marker="o", markersize=3.5, color=colour
        )
    axes.set_yscale("symlog", linthresh=3.0)
    axes.set_yticks([-30, -10, -3, -1, 0, 1, 3, 10, 30], labels=["-30", "-10", "-3", "", "0", "", "3", "10", "30"])
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("model - measured (sigma)")


def write_material(
    verdict: MaterialVerdict,
    folder: Path,
    robot: Robot | None = None,
    provenance: Provenance | None = None,
    robot_file: Path | None = None,
) -> None:
    """Write ``fit.json``, the figure as PNG and SVG, and the lines for a robot file into a folder.

    ``robot`` is written too, as ``robot.toml``, with the rope on all its cables and the comments of its ``robot_file``.
    """
    provenance = provenance or provenance_of()
    write_json(folder / "fit.json", {**material_document(verdict), "provenance": provenance.document()})
    figure = material_figure(verdict)
    figure.savefig(folder / "material.png", dpi=DOTS_PER_INCH)
    figure.savefig(folder / "material.svg")
    rope = fitted_rope(verdict)
    (folder / "relaxation.toml").write_text(f"{provenance.comment()}\n{rope.text()}", encoding="utf-8")
    if robot:
        write_robot(with_material(robot, rope), folder / "robot.toml", provenance, robot_file)
