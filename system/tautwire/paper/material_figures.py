"""Draws Figs 3 and 4: the tensile test and the hysteresis loops of the dynamic tests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from matplotlib.figure import Figure

from .material import (
    BREAKING_FORCE,
    MAX_FORCE_SHARE,
    METALLIC_AREA,
    MIN_FORCE_SHARE,
    RopeTestRuns,
    secant_elongations,
    tensile_modulus,
)
from .parameters import ParameterSetName
from .style import GRID_COLOUR, LINE_COLOURS, PANEL_WIDTH, PaperFigure, legend_above

# Axes as printed: mm and N.
TENSILE_AXIS_LIMITS = ((0.0, 1.8), (-500.0, 3500.0))
LOOP_AXIS_LIMITS = ((-0.2, 0.25), (-600.0, 600.0))


def draw_rope_tests(runs: Mapping[ParameterSetName, RopeTestRuns]) -> Iterator[PaperFigure]:
    """Draw both figures of section 3."""
    yield _draw_tensile_test(runs)
    yield _draw_loops(runs["corrected"])


def _draw_tensile_test(runs: Mapping[ParameterSetName, RopeTestRuns]) -> PaperFigure:
    figure = Figure(figsize=(1.5 * PANEL_WIDTH, 3.3), layout="constrained")
    axes = figure.add_subplot()
    labels: dict[ParameterSetName, str] = {"corrected": "with relaxation", "printed": "elastic"}
    for (name, label), line, colour in zip(labels.items(), ("-", "-."), LINE_COLOURS, strict=False):
        test = runs[name].tensile
        modulus = 1e-9 * tensile_modulus(test, METALLIC_AREA)
        axes.plot(1e3 * test.elongation, test.load, line, color=colour, label=f"{label}: {modulus:.1f} GPa")
    for share, mark in ((MIN_FORCE_SHARE, "F_{10\\%}"), (MAX_FORCE_SHARE, "F_{30\\%}")):
        axes.axhline(share * BREAKING_FORCE, color=GRID_COLOUR, linewidth=0.8, linestyle=":")
        axes.text(0.02, share * BREAKING_FORCE + 40.0, f"${mark}$")
    for elongation, mark in zip(secant_elongations(runs["corrected"].tensile), ("x_1", "x_2"), strict=True):
        axes.axvline(1e3 * elongation, color=GRID_COLOUR, linewidth=0.8, linestyle=":")
        axes.text(1e3 * elongation + 0.015, TENSILE_AXIS_LIMITS[1][0] + 60.0, f"${mark}$")
    axes.set(xlim=TENSILE_AXIS_LIMITS[0], ylim=TENSILE_AXIS_LIMITS[1], xlabel="Elongation (mm)", ylabel="Load (N)")
    legend_above(figure, axes)
    description = (
        "Load over elongation of a cable FMU pulled at 0.05 mm/s up to 30 % of the breaking force and back; moduli by "
        "Eq. 7."
    )
    return PaperFigure("fig_03", "Fig. 3: load and elongation at 0.05 mm/s", description, figure)


def _draw_loops(runs: RopeTestRuns) -> PaperFigure:
    figure = Figure(figsize=(1.5 * PANEL_WIDTH, 3.3), layout="constrained")
    axes = figure.add_subplot()
    shades = np.linspace(0.0, 1.0, len(runs.loops))
    for (frequency, loop), shade in zip(runs.loops.items(), shades, strict=True):
        colour = np.array([0.12, 0.5, 0.65]) * (1.0 - shade) + np.array([0.82, 0.42, 0.15]) * shade
        axes.plot(1e3 * loop.elongation, loop.load, color=colour, label=f"{frequency:g} Hz", linewidth=1.2)
    axes.set(xlim=LOOP_AXIS_LIMITS[0], ylim=LOOP_AXIS_LIMITS[1], xlabel="Elongation (mm)", ylabel="Sinusoidal load (N)")
    axes.legend(loc="lower right", ncols=2)
    description = (
        "Loops of load over elongation at six frequencies, about a preload of 1500 N, of a cable FMU with relaxation."
    )
    return PaperFigure("fig_04", "Fig. 4: loops of the dynamic tests", description, figure)
