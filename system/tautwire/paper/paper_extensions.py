"""Studies beyond the paper, with figures: a rope on a drum, a relaxing rope, a redundant robot, real platforms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..control.feedforward import elastic_reference
from ..materials import RobotMaterial, with_material
from ..robot.schema import Cable, Robot, TensionLimits
from ..robot.trajectory import Helix
from . import rigid_platforms
from .drum_winding import QuasiStaticMotion, follow_path
from .figure_style import GRID_COLOUR, LINE_COLOURS, PaperFigure, label_panel, legend_above, panel_grid
from .helix_runs import TENSION_LAWS
from .paper_parameters import PaperParameters, with_law, with_rope
from .ramp_runs import SAMPLE_COUNTS as RAMP_SAMPLES
from .ramp_runs import dynamic_rope, remaining_amplitude
from .simulation_records import Records, SimulationCase, SimulationRecord, max_abs, path_case, ramp_case

Array = NDArray[np.float64]

# Widths of the frame in m; the three-cable robot's is 100 m.
FRAME_WIDTHS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
COSIMULATED_WIDTHS = (1.0, 10.0, 100.0, 500.0)
PAPER_FRAME_WIDTH = 100.0
QUASI_STATIC_SAMPLES, HELIX_SAMPLES = 400, 500
# The redundant robot: a box about the helix, its lower exit points on the ground; tensions in N.
BOX_HALF_WIDTH, BOX_HEIGHT = 50.0, 50.0
TENSION_LIMITS = TensionLimits(minimum=500.0, maximum=5000.0, preferred=1500.0)

REDUNDANT_CABLES = range(1, 9)


@dataclass(frozen=True)
class SizeStudy:
    """Errors of the laws at each frame width (m), upward and downward: ``errors[direction, law]`` (M,) in m.

    ``cosimulated`` are those of FMUs, upward. ``relative_errors`` (one for each law) are the largest error as a share
    of the largest positioning error of the exact rope, upward.
    """

    widths: tuple[float, ...]
    errors: Mapping[tuple[str, str], Array]
    cosimulated: Mapping[str, Mapping[float, float]]
    relative_errors: Mapping[str, float]


def scaled_robot(robot: Robot, path: Helix, size: float) -> tuple[Robot, Helix]:
    """Scale the three-cable robot and its helix to another size (m), at the same accelerations: the same tensions."""
    factor = size / PAPER_FRAME_WIDTH
    x, y, z = (factor * value for value in robot.platform.start)
    cables = tuple(replace(c, anchor=_scaled_point(c.anchor, factor)) for c in robot.cables)
    scaled = replace(robot, platform=replace(robot.platform, start=(x, y, z)), cables=cables)
    centre, time = _scaled_point(path.centre, factor), factor**0.5
    return scaled, Helix(centre, factor * path.radius, factor * path.rise, path.angle, time * path.duration)


def downward_helix(robot: Robot, path: Helix) -> tuple[Robot, Helix]:
    """The robot at the upper end of its helix, and the way back down."""
    x, y, z = path.position(np.array([path.duration]))[0].tolist()
    placed = replace(robot, platform=replace(robot.platform, start=(x, y, z)))
    centre = (path.centre[0], path.centre[1], z)
    return placed, Helix(centre, path.radius, -path.rise, -path.angle, path.duration)


def cases(parameters: PaperParameters, rope: RobotMaterial) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of scaled robots with both laws, of relaxing and constant ropes on helix and ramp, of a redundant robot."""
    robot, path, ramp = parameters.robots["three"], parameters.helices["three"], parameters.ramps["three"]
    for size in COSIMULATED_WIDTHS:
        scaled, helix = scaled_robot(robot, path, size)
        for law in TENSION_LAWS:
            yield f"size {size:g}/{law}", path_case(with_law(scaled, law), helix, HELIX_SAMPLES)
    pair = dynamic_rope("three")
    relaxing, constant = with_material(robot, rope), with_rope(robot, pair.modulus, pair.damping)
    yield "three/relaxing helix", path_case(relaxing, path, HELIX_SAMPLES)
    yield "three/constant helix", path_case(constant, path, HELIX_SAMPLES)
    yield "three/relaxing", ramp_case(relaxing, ramp, RAMP_SAMPLES["three"])
    eight_cables = redundant_robot(robot, path)
    rigid = path_case(eight_cables, path, HELIX_SAMPLES)
    yield "eight/rigid", rigid
    speeds = elastic_reference(eight_cables, path, rigid.time).speeds
    yield "eight/distributed", replace(rigid, winch_speed=speeds)
    yield from rigid_platforms.cases(parameters)


def redundant_robot(robot: Robot, path: Helix) -> Robot:
    """Eight cables of the three-cable robot's rope from the corners of a box about its helix."""
    rope = robot.cables[0]
    corners = [
        (path.centre[0] + BOX_HALF_WIDTH * x, path.centre[1] + BOX_HALF_WIDTH * y, z)
        for z in (BOX_HEIGHT, 0.0)
        for x, y in ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    ]
    cables = tuple(Cable(corner, rope.modulus, rope.area, rope.damping, rope.law) for corner in corners)
    return replace(robot, name="eight cables", tension=TENSION_LIMITS, cables=cables)


def compare_sizes(parameters: PaperParameters, records: Records) -> SizeStudy:
    """Compare each law with the exact rope, at every size, upward and downward."""
    robot, path = parameters.robots["three"], parameters.helices["three"]
    errors: dict[tuple[str, str], list[float]] = {}
    cosimulated: dict[str, dict[float, float]] = {law: {} for law in TENSION_LAWS}
    relative_errors: dict[str, float] = {}
    for size in FRAME_WIDTHS:
        up = scaled_robot(robot, path, size)
        for direction, (scaled, helix) in (("up", up), ("down", downward_helix(*up))):
            time = np.linspace(0.0, helix.duration, QUASI_STATIC_SAMPLES + 1)
            exact = follow_path(scaled, helix, time, "exact")
            for law in TENSION_LAWS:
                error = _max_distance(follow_path(scaled, helix, time, law).position, exact.position)
                errors.setdefault((direction, law), []).append(error)
                if direction == "up" and size == PAPER_FRAME_WIDTH:
                    relative_errors[law] = error / _max_distance(exact.position, helix.position(time))
                if direction == "up" and size in COSIMULATED_WIDTHS:
                    cosimulated[law][size] = _cosimulated_error(records[f"size {size:g}/{law}"], exact)
    return SizeStudy(
        FRAME_WIDTHS, {key: np.array(values) for key, values in errors.items()}, cosimulated, relative_errors
    )


def _cosimulated_error(run: SimulationRecord, exact: QuasiStaticMotion) -> float:
    path = np.column_stack([np.interp(exact.time, run.time, run[axis]) for axis in "xyz"])
    return _max_distance(path, exact.position)


def _max_distance(path: Array, other: Array) -> float:
    return float(np.max(np.linalg.norm(path - other, axis=1)))


def _scaled_point(point: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    return factor * point[0], factor * point[1], factor * point[2]


@dataclass(frozen=True)
class ExtensionFigure:
    """A figure beyond the paper with its paragraph."""

    figure: PaperFigure
    paragraph: str


def draw_extensions(parameters: PaperParameters, records: Records, sizes: SizeStudy) -> Iterator[ExtensionFigure]:
    """Draw all four figures beyond the paper."""
    yield ExtensionFigure(_draw_size_study(sizes), _size_study_text(sizes))
    yield ExtensionFigure(_draw_relaxation(records), _relaxation_text(records))
    yield ExtensionFigure(_draw_redundant(records), _redundant_text(records))
    text = rigid_platforms.platforms_text(parameters, records)
    yield ExtensionFigure(rigid_platforms.draw_platforms(records), text)


def _draw_size_study(sizes: SizeStudy) -> PaperFigure:
    figure, axes = panel_grid(2, 2)
    for panel, (direction, title) in zip(axes, (("up", "upward"), ("down", "downward")), strict=True):
        for law, colour, line in (("logarithmic", LINE_COLOURS[0], "-"), ("linear", LINE_COLOURS[1], "-.")):
            panel.loglog(sizes.widths, 1e3 * sizes.errors[direction, law], line, color=colour, label=law)
            if direction == "up":
                errors = [1e3 * sizes.cosimulated[law][size] for size in COSIMULATED_WIDTHS]
                panel.loglog(COSIMULATED_WIDTHS, errors, "o", color=colour, markersize=4.5, label=f"{law}, FMUs")
        label_panel(panel, "Off the exact rope (mm)", f"Helix {title}", "Width of the frame (m)")
    legend_above(figure, axes[0])
    description = (
        "Largest distance of each law's path from that of a rope on a drum, over sizes from 1 to 500 m, up and down."
    )
    return PaperFigure("beyond_drum", "Both laws against a rope on a drum", description, figure)


def _size_study_text(sizes: SizeStudy) -> str:
    index = sizes.widths.index(PAPER_FRAME_WIDTH)
    linear, logarithmic = (
        {way: 1e3 * sizes.errors[way, law][index] for way in ("up", "down")} for law in ("linear", "logarithmic")
    )
    shares = {law: f"{100.0 * error:.1f} %" for law, error in sizes.relative_errors.items()}
    width_at_1_mm = PAPER_FRAME_WIDTH / linear["up"]
    return (
        "A rope that is reeled in lies on the drum with the strain that it had, and comes off with it again; rope "
        "that lay there from the start comes off as tight as it was wound. The logarithmic law is right for the "
        f"first, the linear one for the second. On the paper's robot ({PAPER_FRAME_WIDTH:g} m) the linear law is "
        f"off by {linear['up']:.1f} mm upward and {linear['down']:.1f} mm downward, the logarithmic one by "
        f"{logarithmic['up']:.1f} and {logarithmic['down']:.1f} mm. With the same tensions the strains "
        "are the same at every size, so these grow in proportion to it and stay the same share of the positioning "
        f"error upward: {shares['linear']} for the linear law, {shares['logarithmic']} for the "
        "logarithmic one. What size decides is whether that is to be seen: the linear law is off by 1 mm from "
        f"{width_at_1_mm:.0f} m on. The figure takes the platform to move slowly; dots are co-simulated with all "
        "dynamics."
    )


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
        label_panel(panel, label, title)
    legend_above(figure, axes[0])
    description = (
        "Elongation and error along z on the ramp, and error along z on the helix, with a constant pair of modulus and "
        "damping and with relaxation."
    )
    return PaperFigure("beyond_relaxation", "A modulus that depends on frequency", description, figure)


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
        f"{amplitudes[1]:.0f} % of the swing of r1 is left late in the ramp's hold, where the pair of section "
        f"4.3 leaves {amplitudes[0]:.0f} %; the paths are up to {gap:.1f} mm apart. On the helix the "
        f"largest positioning error is {errors[1]:.1f} mm, with the constant pair {errors[0]:.1f} mm, with the "
        f"quasi-static modulus {errors[2]:.1f} mm: there the rope is as soft as the static test says, and the "
        "dynamic modulus is the wrong one."
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
        label_panel(panel, "Tension (N)", title)
    for key, label, line in (("three/logarithmic", "three cables", ":"), ("eight/rigid", "eight, inelastic", "-.")):
        axes[2].semilogy(records[key].time[1:], 1e3 * records[key]["error_norm"][1:], line, label=label)
    run = records["eight/distributed"]
    axes[2].semilogy(run.time[1:], 1e3 * run["error_norm"][1:], label="eight, distributed")
    axes[2].set_ylim(1e-2, None)
    axes[2].legend(loc="lower center")
    label_panel(axes[2], "Position error (mm)", "Error")
    description = (
        "Tensions of eight cables on the helix with the winch speeds of inelastic ropes and with tension distribution; "
        "positioning errors beside three cables'."
    )
    return PaperFigure("beyond_redundant", "Eight cables on the same helix", description, figure)


def _redundant_text(records: Records) -> str:
    rigid, run, three = records["eight/rigid"], records["eight/distributed"], records["three/logarithmic"]
    min_tension = min(float(np.min(run[f"tension_{cable}"])) for cable in REDUNDANT_CABLES)
    max_tension = max(max_abs(run[f"tension_{cable}"]) for cable in REDUNDANT_CABLES)
    errors = [1e3 * max_abs(each["error_norm"]) for each in (rigid, run, three)]
    return (
        "The paper closes with the wish for redundant robots and tension distribution. Here eight of the same ropes "
        "hold the same mass on the same helix, from the corners of a box of 100 m by 100 m by 50 m. The start "
        f"tensions are those nearest to {TENSION_LIMITS.preferred:g} N within {TENSION_LIMITS.minimum:g} and "
        f"{TENSION_LIMITS.maximum:g} N; along the path the winch speeds cancel the stretch and keep the "
        "tensions nearest to those at the start. "
        f"They stay between {min_tension:.0f} and {max_tension:.0f} N. The largest error is {errors[1]:.1f} mm; with "
        f"the speeds of inelastic ropes it is {errors[0]:.0f} mm, as the four lower ropes pull down on what the "
        f"upper ones let stretch (three cables: {errors[2]:.0f} mm)."
    )
