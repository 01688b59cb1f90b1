"""Figure of storage modulus and damping over frequency, measured and by each model."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .modulus import storage_modulus, viscous_damping
from .verdict import EvaluatedModel, MaterialVerdict, Role
from .wording import MODEL_TITLES

GIGA = 1e9
CURVE_POINTS = 400
LINE_STYLES: dict[Role, tuple[str, str]] = {
    "declared": ("#999999", ":"),
    "constant": ("#d55e00", "--"),
    "relaxation": ("#0072b2", "-"),
    "chosen": ("#009e73", "-"),
}


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
