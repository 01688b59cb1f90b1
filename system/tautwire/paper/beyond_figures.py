"""The figures beyond the paper, each with its paragraph."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from .beyond import COSIMULATED_WIDTHS, PAPER_FRAME_WIDTH, TENSION_LIMITS, SizeStudy
from .ramps import remaining_amplitude
from .records import Records
from .style import GRID_COLOUR, LINE_COLOURS, PaperFigure, legend_above, panel_grid
from .values import max_abs

REDUNDANT_CABLES = range(1, 9)


@dataclass(frozen=True)
class ExtensionFigure:
    """A figure beyond the paper with its paragraph."""

    figure: PaperFigure
    paragraph: str


def draw_extensions(records: Records, sizes: SizeStudy) -> Iterator[ExtensionFigure]:
    """Draw all three figures beyond the paper."""
    yield ExtensionFigure(_draw_size_study(sizes), _size_study_text(sizes))
    yield ExtensionFigure(_draw_relaxation(records), _relaxation_text(records))
    yield ExtensionFigure(_draw_redundant(records), _redundant_text(records))


def _draw_size_study(sizes: SizeStudy) -> PaperFigure:
    figure, axes = panel_grid(2, 2)
    for panel, (direction, title) in zip(axes, (("up", "upward"), ("down", "downward")), strict=True):
        for law, colour, line in (("logarithmic", LINE_COLOURS[0], "-"), ("linear", LINE_COLOURS[1], "-.")):
            panel.loglog(sizes.widths, 1e3 * sizes.errors[direction, law], line, color=colour, label=law)
            if direction == "up":
                errors = [1e3 * sizes.cosimulated[law][size] for size in COSIMULATED_WIDTHS]
                panel.loglog(COSIMULATED_WIDTHS, errors, "o", color=colour, markersize=4.5, label=f"{law}, FMUs")
        panel.set_xlabel("Width of the frame (m)")
        panel.set_ylabel("Off the exact rope (mm)")
        panel.set_title(f"Helix {title}", loc="left", fontsize="medium")
    legend_above(figure, axes[0])
    description = (
        "Largest distance of each law's path from that of a rope on a drum, over sizes from 1 to 500 m, up and down."
    )
    return PaperFigure("beyond_drum", "Both laws against a rope on a drum", description, figure)


def _size_study_text(sizes: SizeStudy) -> str:
    index = sizes.widths.index(PAPER_FRAME_WIDTH)
    deviations = {key: 1e3 * errors[index] for key, errors in sizes.errors.items()}
    width_at_1_mm = PAPER_FRAME_WIDTH / deviations["up", "linear"]
    return (
        "A rope that is reeled in lies on the drum with the strain that it had, and comes off with it again; rope "
        "that lay there from the start comes off as tight as it was wound. The logarithmic law is right for the "
        f"first, the linear one for the second. On the paper's robot ({PAPER_FRAME_WIDTH:g} m) the linear law is off by "
        f"{deviations['up', 'linear']:.1f} mm upward and {deviations['down', 'linear']:.1f} mm downward, the logarithmic one by "
        f"{deviations['up', 'logarithmic']:.1f} and {deviations['down', 'logarithmic']:.1f} mm. With the same tensions the strains "
        "are the same at every size, so these grow in proportion to it and stay the same share of the positioning "
        f"error upward: {_percent_text(sizes, 'linear')} for the linear law, {_percent_text(sizes, 'logarithmic')} for the "
        "logarithmic one. What size decides is whether that is to be seen: the linear law is off by 1 mm from "
        f"{width_at_1_mm:.0f} m on. The figure takes the platform to move slowly; dots are co-simulated with all dynamics."
    )


def _percent_text(sizes: SizeStudy, law: str) -> str:
    return f"{100.0 * sizes.relative_errors[law]:.1f} %"


def _draw_relaxation(records: Records) -> PaperFigure:
    figure, axes = panel_grid(3, 3)
    ramp = (("three/damped", "constant pair", "-."), ("three/relaxing", "with relaxation", "-"))
    for (key, label, line), colour in zip(ramp, (LINE_COLOURS[1], LINE_COLOURS[0]), strict=True):
        run = records[key]
        axes[0].plot(run.time, 1e3 * run["elongation_1"], line, color=colour, label=label)
        axes[1].plot(run.time, 1e3 * run["error_z"], line, color=colour)
        helix = records[f"three/{'constant' if 'damped' in key else 'relaxing'} helix"]
        axes[2].plot(helix.time, 1e3 * helix["error_z"], line, color=colour)
    static = records["three/logarithmic"]
    axes[2].plot(static.time, 1e3 * static["error_z"], ":", color=LINE_COLOURS[2], label="quasi-static, 102.2 GPa")
    axes[2].legend(loc="lower right")
    for panel, label, title in zip(
        axes, ("$r_1$ (mm)", "$\\Delta z$ (mm)", "$\\Delta z$ (mm)"), ("Ramp", "Ramp", "Helix"), strict=True
    ):
        panel.set_xlabel("Time (s)")
        panel.set_ylabel(label)
        panel.set_title(title, loc="left", fontsize="medium")
    legend_above(figure, axes[0])
    description = (
        "Elongation and error along z on the ramp, and error along z on the helix, with a constant pair of modulus and "
    )
    return PaperFigure(
        "beyond_relaxation", "A modulus that depends on frequency", description + "damping and with relaxation.", figure
    )


def _relaxation_text(records: Records) -> str:
    pair, relaxing = records["three/damped"], records["three/relaxing"]
    amplitudes = [remaining_amplitude(run) for run in (pair, relaxing)]
    gap = 1e3 * max(max_abs(pair[axis] - relaxing[axis]) for axis in "xyz")
    constant, slow = records["three/constant helix"], records["three/relaxing helix"]
    static = records["three/logarithmic"]
    errors = [1e3 * max_abs(run["error_norm"]) for run in (constant, slow, static)]
    return (
        "One constant pair cannot hold over a run: Table 1's modulus at 2 Hz is that of the swing, while the helix "
        "takes 50 s. With the relaxation model (fitted to Table 1 and the static test) in the FMUs, "
        f"{amplitudes[1]:.0f} % of the swing of r1 is left late in the ramp's hold, where the pair of section 4.3 leaves "
        f"{amplitudes[0]:.0f} %; the paths are up to {gap:.1f} mm apart. On the helix the largest positioning error is "
        f"{errors[1]:.1f} mm, with the constant pair {errors[0]:.1f} mm, with the quasi-static modulus "
        f"{errors[2]:.1f} mm: there the rope is as soft as the static test says, and the dynamic modulus is the "
        "wrong one."
    )


def _draw_redundant(records: Records) -> PaperFigure:
    figure, axes = panel_grid(3, 3)
    for panel, key, title in zip(axes, ("rigid", "distributed"), ("Inelastic speeds", "Distributed"), strict=False):
        run = records[f"eight/{key}"]
        for cable in REDUNDANT_CABLES:
            line = "-" if cable <= 4 else "--"
            panel.plot(run.time, run[f"tension_{cable}"], line, color=LINE_COLOURS[(cable - 1) % 4], linewidth=1.1)
        panel.axhline(TENSION_LIMITS.minimum, color=GRID_COLOUR, linestyle=":", linewidth=1.0)
        panel.set_ylim(0.0, None)
        _label_axes(panel, "Tension (N)", title)
    for key, label, line in (("three/logarithmic", "three cables", ":"), ("eight/rigid", "eight, inelastic", "-.")):
        axes[2].semilogy(records[key].time[1:], 1e3 * records[key]["error_norm"][1:], line, label=label)
    run = records["eight/distributed"]
    axes[2].semilogy(run.time[1:], 1e3 * run["error_norm"][1:], label="eight, distributed")
    axes[2].set_ylim(1e-2, None)
    axes[2].legend(loc="lower center")
    _label_axes(axes[2], "Position error (mm)", "Error")
    description = (
        "Tensions of eight cables on the helix with the winch speeds of inelastic ropes and with tension distribution; "
    )
    return PaperFigure(
        "beyond_redundant",
        "Eight cables on the same helix",
        description + "positioning errors beside three cables'.",
        figure,
    )


def _label_axes(axes: Axes, label: str, title: str) -> None:
    axes.set_xlabel("Time (s)")
    axes.set_ylabel(label)
    axes.set_title(title, loc="left", fontsize="medium")


def _redundant_text(records: Records) -> str:
    rigid, run, three = records["eight/rigid"], records["eight/distributed"], records["three/logarithmic"]
    min_tension = min(float(np.min(run[f"tension_{cable}"])) for cable in REDUNDANT_CABLES)
    max_tension = max(max_abs(run[f"tension_{cable}"]) for cable in REDUNDANT_CABLES)
    errors = [1e3 * max_abs(each["error_norm"]) for each in (rigid, run, three)]
    return (
        "The paper closes with the wish for redundant robots and tension distribution. Here eight of the same ropes "
        "hold the same mass on the same helix, from the corners of a box of 100 m by 100 m by 50 m. The start "
        f"tensions are those nearest to {TENSION_LIMITS.preferred:g} N within {TENSION_LIMITS.minimum:g} and {TENSION_LIMITS.maximum:g} N; "
        "along the path the winch speeds cancel the stretch and keep the tensions nearest to those at the start. "
        f"They stay between {min_tension:.0f} and {max_tension:.0f} N. The largest error is {errors[1]:.1f} mm; with the speeds "
        f"of inelastic ropes it is {errors[0]:.0f} mm, as the four lower ropes pull down on what the upper ones let "
        f"stretch (three cables: {errors[2]:.0f} mm)."
    )
