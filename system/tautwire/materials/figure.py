"""Storage modulus and damping over frequency: what was measured, and what the models say."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .modulus import damping, storage_modulus
from .verdict import MaterialVerdict, Model, Role
from .wording import TITLES

GIGA = 1e9
POINTS = 400
STYLES: dict[Role, tuple[str, str]] = {
    "declared": ("#999999", ":"),
    "constant": ("#d55e00", "--"),
    "relaxation": ("#0072b2", "-"),
    "chosen": ("#009e73", "-"),
}


def material_figure(verdict: MaterialVerdict) -> Figure:
    """E' and c against frequency with error bars of one sigma, and below them each model's residuals in sigmas."""
    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, height_ratios=[2.0, 1.0])
    models = _shown(verdict)
    _values(axes[0, 0], axes[0, 1], verdict, models)
    _residuals(axes[1, 0], [(model, model.storage_sigmas) for model in models], verdict)
    _residuals(axes[1, 1], [(model, model.damping_sigmas) for model in models], verdict)
    figure.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _shown(verdict: MaterialVerdict) -> list[Model]:
    """One model of each role that has a style; relaxation alone only once where it is what was chosen."""
    found = [model for model in verdict.models if model.role in STYLES]
    chosen = verdict.after.material
    return [model for model in found if model.role in ("declared", "chosen") or model.material != chosen]


def _values(storage: Axes, viscous: Axes, verdict: MaterialVerdict, models: list[Model]) -> None:
    seen = verdict.seen
    frequency = np.geomspace(seen.frequency.min() / 2.0, seen.frequency.max() * 2.0, POINTS)
    amplitude = _between_rows(verdict, frequency)
    for model in models:
        colour, line = STYLES[model.role]
        label = f"{TITLES[model.role]}: {model.label}, $\\chi^2$ = {model.chi_squared:.4g}"
        curve = storage_modulus(model.material, frequency, amplitude)
        storage.plot(frequency, curve / GIGA, line, color=colour)
        curve = damping(model.material, frequency, amplitude)
        viscous.plot(frequency, curve / GIGA, line, color=colour, label=label)
    for axes, measured, sigma in (
        (storage, seen.storage, seen.storage_uncertainty),
        (viscous, seen.damping, seen.damping_uncertainty),
    ):
        axes.errorbar(
            seen.frequency,
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


def _between_rows(verdict: MaterialVerdict, frequency: np.ndarray) -> np.ndarray:
    """The strain amplitude at frequencies between the rows, by their logarithms; that of the end rows beyond."""
    seen = verdict.seen
    if not seen.has_amplitude:
        return np.full_like(frequency, np.inf)
    order = np.argsort(seen.frequency)
    known = np.log(seen.frequency[order]), np.log(seen.amplitude[order])
    between: np.ndarray = np.exp(np.interp(np.log(frequency), *known))
    return between


def _residuals(axes: Axes, columns: list[tuple[Model, np.ndarray]], verdict: MaterialVerdict) -> None:
    axes.axhspan(-1.0, 1.0, color="0.92")
    for model, sigmas in columns:
        colour, line = STYLES[model.role]
        order = np.argsort(verdict.seen.frequency)
        axes.plot(verdict.seen.frequency[order], sigmas[order], line, marker="o", markersize=3.5, color=colour)
    axes.set_yscale("symlog", linthresh=3.0)
    axes.set_yticks([-30, -10, -3, -1, 0, 1, 3, 10, 30], labels=["-30", "-10", "-3", "", "0", "", "3", "10", "30"])
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("model - measured (sigma)")
