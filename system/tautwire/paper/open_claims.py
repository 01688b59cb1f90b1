"""Alternative readings tried on the claims that the figures' parameters leave open, each with its numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from ..linear.linear_plant import linearise
from ..recordings.start_position import with_start
from ..robot.schema import Robot
from .paper_parameters import PaperParameters, with_law, with_rope
from .ramp_runs import PLOT_START_TIME, dynamic_rope
from .rope_tests import DISC_AREA, METALLIC_AREA
from .simulation_records import (
    Records,
    SimulationCase,
    SimulationRecord,
    dominant_frequency,
    max_abs,
    path_case,
    ramp_case,
)

Array = NDArray[np.float64]
ReadingRow = tuple[str, tuple[str, ...]]

DISC_AREA_6_MM = math.pi * 3e-3**2  # m^2, the disc of a 6 mm rope
# CAROCA's runs with other ropes: the areas, in m^2.
CAROCA_ROPE_AREAS = {"Ac, 7.17 mm^2": METALLIC_AREA, "disc of 4 mm": DISC_AREA, "disc of 6 mm": DISC_AREA_6_MM}
FITTED_POSITION = (50.0, 0.0, 5.0)  # m, by a search over positions: the only kind of position that fits Fig. 15


@dataclass(frozen=True)
class OpenClaim:
    """One open claim: alternative readings row by row, below the paper's numbers; ``lead`` states the outcome."""

    title: str
    lead: str
    columns: tuple[str, ...]
    rows: tuple[ReadingRow, ...]


def cases(parameters: PaperParameters) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of CAROCA with other ropes, and of the three-cable ramp with damping at the quasi-static modulus too."""
    robot, helix, ramp = parameters.robots["caroca"], parameters.helices["caroca"], parameters.ramps["caroca"]
    modulus, dynamic = robot.cables[0].modulus, dynamic_rope("caroca").modulus
    for name, area in CAROCA_ROPE_AREAS.items():
        variant = with_rope(robot, modulus, area=area)
        for law in ("logarithmic", "linear"):
            yield f"caroca {name}/{law}", path_case(with_law(variant, law), helix, 400)
        yield f"caroca {name}/static", ramp_case(variant, ramp, 800)
        yield f"caroca {name}/dynamic", ramp_case(with_rope(robot, dynamic, area=area), ramp, 800)
    three_cables = parameters.robots["three"]
    damped = with_rope(three_cables, three_cables.cables[0].modulus, dynamic_rope("three").damping)
    yield "three/static damped", ramp_case(damped, parameters.ramps["three"], 2100)


def examine_open_claims(parameters: PaperParameters, records: Records) -> tuple[OpenClaim, ...]:
    """Examine all open claims with the corrected parameters."""
    return (
        _law_readings(records),
        _reading_times(records),
        _rope_areas(records),
        _error_readings(records),
        _desired_paths(parameters, records),
        _frequency_variants(parameters),
    )


def elongations_by_reading(run: SimulationRecord, stiffness: float, cable: int) -> Mapping[str, Array]:
    """The paper's r (m) of a cable under one tension, by each reading of its two laws, from a run's T and l.

    With ``e = (T - T0) / (E S)``: ``l e`` (Eq. 1 with k = E S / l), ``l0 e`` (with k = E S / l0), and the integral of
    ``l de`` (Eq. 2); ``wound``, ``l (1 - exp(-e))``, is Eq. 3 with l0 moving by the winch alone. ``stiffness`` is E S
    in N.
    """
    length, tension = run[f"length_{cable}"], run[f"tension_{cable}"]
    strain = (tension - tension[0]) / stiffness
    return {
        "now": length * strain,
        "start": length[0] * strain,
        "integral": np.asarray(cumulative_trapezoid(length, strain, initial=0)),
        "wound": -length * np.expm1(-strain),
    }


def _law_readings(records: Records) -> OpenClaim:
    """Readings of which two laws are compared on the helix."""
    run = records["three/logarithmic"]
    readings = {
        "r = l e against the integral of l de": ("now", "integral"),
        "r = l0 e against the integral of l de": ("start", "integral"),
        "r = l0 e against r = l e": ("start", "now"),
        "r = l e against ln(l / (l - r)) = e": ("now", "wound"),
    }
    rows: list[ReadingRow] = [("Paper", ("2.4", "27.5", "2.9", "39"))]
    for label, (first, second) in readings.items():
        cells = []
        for cable, moment in ((1, 27.5), (2, 39.0)):
            elongations = elongations_by_reading(run, 102.2e9 * DISC_AREA, cable)
            difference = np.abs(elongations[first] - elongations[second])
            cells += [f"{1e3 * np.interp(moment, run.time, difference):.3g}", f"{run.time[np.argmax(difference)]:.1f}"]
        rows.append((label, tuple(cells)))
    return OpenClaim(
        "The laws on the helix",
        "The first reading is the paper's Eqs 1 and 3, which all figures here use. Its differences are largest where "
        "the ropes change from reeling in to paying out; the times in the text are those of the extrema of r. The "
        "second reading has its largest difference of r2 there too, but hardly any in r1; the last has none.",
        ("Readings", "r1 at 27.5 s, mm", "Largest at, s", "r2 at 39 s, mm", "Largest at, s"),
        tuple(rows),
    )


def _reading_times(records: Records) -> OpenClaim:
    """Readings of when, and relative to which law, the text takes its numbers of cable 1."""
    logarithmic, linear = records["three/logarithmic"], records["three/linear"]
    difference = np.abs(linear["elongation_1"] - logarithmic["elongation_1"])
    gap_time = float(logarithmic.time[np.argmax(difference >= 2.4e-3)])
    rows: list[ReadingRow] = [("Paper", ("2.4", "14", "", "0.003", "12", ""))]
    for moment in (27.5, gap_time):
        cells: list[str] = []
        for name, scale in (("elongation_1", 1e3), ("strain_1", 100.0)):
            values = [run.at(name, moment) for run in (logarithmic, linear)]
            gap = abs(values[1] - values[0])
            cells += [f"{scale * gap:.2g}", *(f"{100.0 * gap / abs(value):.1f}" for value in values)]
        rows.append((f"{moment:.1f} s", tuple(cells)))
    return OpenClaim(
        "The time of the 2.4 mm",
        "Elongation and strain of a cable differ by the same percentage, so 14 and 12 % refer to different laws or "
        "different times. At the time in the text they are relative to one law each. The difference reaches 2.4 mm a "
        "second later, 14 % of the logarithmic law's elongation, whereas the text's strains are those at 27.5 s.",
        ("Time", "Gap of r1, mm", "% of logarithmic", "% of linear", "Gap of strain 1, %", "% of log.", "% of lin."),
        tuple(rows),
    )


def _rope_areas(records: Records) -> OpenClaim:
    """Rope areas for CAROCA: its tension and strain scales."""
    named = {
        **{f"{name}, 102.2 GPa": f"caroca {name}" for name in CAROCA_ROPE_AREAS},
        "fitted, E S = 2.81e6 N": "caroca",
    }
    rows: list[ReadingRow] = [("Paper", ("0.034", "0.18", "0.007", "0.06", "0.1, 0.05, 1.26", "10 to 11"))]
    for label, key in named.items():
        rows.append((label, _caroca_row(records, key)))
    return OpenClaim(
        "CAROCA's rope",
        "The elongations and errors of Figs 10 and 11 and the path of the ramp require E S = 2.8e6 N, a rope 2.2 times "
        "as stiff as the disc of 4 mm; the disc of 6 mm is within 3 %. The frequency requires the disc of 4 mm. With "
        "every rope the ramps differ more along y than along x.",
        (
            "Area and modulus",
            "Gap of r2 at 4 s, mm",
            "Largest r2, mm",
            "Largest strain 2, %",
            "Gap of error, mm",
            "Ramp: gaps of x, y, z, mm",
            "Ramp, static modulus: Hz",
        ),
        tuple(rows),
    )


def _caroca_row(records: Records, key: str) -> tuple[str, ...]:
    logarithmic, linear = records[f"{key}/logarithmic"], records[f"{key}/linear"]
    static, dynamic = records[f"{key}/static"], records[f"{key}/dynamic"]
    return (
        f"{1e3 * abs(linear['elongation_2'][-1] - logarithmic['elongation_2'][-1]):.3f}",
        f"{1e3 * max_abs(logarithmic['elongation_2']):.2f}",
        f"{100.0 * max_abs(logarithmic['strain_2']):.4f}",
        f"{1e3 * abs(linear['error_norm'][-1] - logarithmic['error_norm'][-1]):.3f}",
        ", ".join(f"{1e3 * max_abs(static[axis] - dynamic[axis]):.2f}" for axis in "xyz"),
        f"{dominant_frequency(static.time, static['elongation_2']):.1f}",
    )


def _error_readings(records: Records) -> OpenClaim:
    """Readings of what the RMS of Fig. 11 is taken over."""
    readings: Mapping[str, Callable[[SimulationRecord], Array]] = {
        "Distance from the desired position": lambda run: run["error_norm"],
        "RMS over x, y and z": lambda run: run["error_norm"] / math.sqrt(3.0),
        "RMS of the distance over time so far": lambda run: np.sqrt(
            np.cumsum(run["error_norm"] ** 2) / np.arange(1, len(run.time) + 1)
        ),
    }
    rows: list[ReadingRow] = [("Paper", ("0.9", "0.06", "0.4", "21.52"))]
    for label, reading in readings.items():
        cells = []
        for robot, scale in (("caroca", 1e3), ("fast", 1.0)):
            linear, logarithmic = (reading(records[f"{robot}/{law}"]) for law in ("linear", "logarithmic"))
            max_error = scale * max(max_abs(linear), max_abs(logarithmic))
            cells += [f"{max_error:.2g}", f"{1e3 * abs(linear[-1] - logarithmic[-1]):.2g}"]
        rows.append((label, tuple(cells)))
    return OpenClaim(
        "The RMS of Fig. 11",
        "CAROCA's axis and its 0.06 mm agree with the distance, which all figures here use. FAST's axis agrees with "
        "either RMS, its 21.52 mm with neither.",
        ("Reading", "CAROCA: axis, mm", "Gap at 4 s, mm", "FAST: axis, m", "Gap at 40 s, mm"),
        tuple(rows),
    )


def _desired_paths(parameters: PaperParameters, records: Records) -> OpenClaim:
    """Candidate desired paths for the errors of Fig. 14."""
    run = records["three/static"]
    inelastic_path = np.column_stack([run[axis] + run[f"error_{axis}"] for axis in "xyz"])
    printed = np.array([20.30, 0.23, 8.5])
    start = np.array(parameters.ramps["three"].start)
    share = np.linalg.norm(inelastic_path - start, axis=1) / np.linalg.norm(inelastic_path[-1] - start)
    references = {
        "Path with inelastic ropes": inelastic_path,
        "The same, shifted to end at P3 as printed": inelastic_path + (printed - inelastic_path[-1]),
        "Straight line from P1 to P3 as printed": start + np.outer(share, printed - start),
    }
    undamped = ("three/static", "three/dynamic")
    rows: list[ReadingRow] = [("Fig. 14's axes", ("-10 to 25", "-4 to 3", "-10 to 70"))]
    for label, reference in references.items():
        for sign, sign_text in ((1.0, "actual minus desired"), (-1.0, "desired minus actual")):
            rows.append((f"{label}; {sign_text}", _error_ranges(records, undamped, reference, sign)))
    with_damping = ("three/static damped", "three/damped")
    rows.append(("As the first, with damping in both", _error_ranges(records, with_damping, inelastic_path, 1.0)))
    rows.append(("Gaps between the moduli, undamped", _max_gaps(records, undamped)))
    rows.append(("Gaps between the moduli, damped", _max_gaps(records, with_damping)))
    return OpenClaim(
        "The desired path of Fig. 14",
        "Along y the axis agrees with the first reading with the opposite sign. An error of 60 mm along z results only "
        "from P3 as rounded in the text. No single reading gives all three axes, nor the 8, 4.5 and 9 mm between the "
        "moduli.",
        ("Desired path", "x, mm", "y, mm", "z, mm"),
        tuple(rows),
    )


def _error_ranges(records: Records, keys: Sequence[str], reference: Array, sign: float) -> tuple[str, ...]:
    cells = []
    for index, axis in enumerate("xyz"):
        errors = [
            1e3 * sign * (records[key][axis] - reference[:, index])[records[key].time >= PLOT_START_TIME]
            for key in keys
        ]
        cells.append(f"{min(map(np.min, errors)):.1f} to {max(map(np.max, errors)):.1f}")
    return tuple(cells)


def _max_gaps(records: Records, keys: tuple[str, str]) -> tuple[str, ...]:
    first, second = (records[key] for key in keys)
    plotted = first.time >= PLOT_START_TIME
    return tuple(f"{1e3 * max_abs((first[axis] - second[axis])[plotted]):.1f}" for axis in "xyz")


def _frequency_variants(parameters: PaperParameters) -> OpenClaim:
    """Robots whose frequencies Fig. 15 may show."""
    robot = parameters.robots["three"]
    lighter_robot = replace(robot, platform=replace(robot.platform, mass=100.0))
    modulus = robot.cables[0].modulus
    fitted_area = parameters.robots["caroca"].cables[0].area
    robots: Mapping[str, Robot] = {
        "Disc of 4 mm, 102.2 GPa, 300 kg, P1": robot,
        "Ac": with_rope(robot, modulus, area=METALLIC_AREA),
        "CAROCA's fitted rope": with_rope(robot, modulus, area=fitted_area),
        "200 GPa, solid steel": with_rope(robot, 200e9),
        "100 kg, CAROCA's mass": lighter_robot,
        "100 kg, at (50, 0, 5) m": with_start(lighter_robot, FITTED_POSITION),
    }
    rows: list[ReadingRow] = [("Paper, Fig. 15 at its start", ("1.67", "2.2", "2.35"))]
    for label, variant in robots.items():
        frequencies = linearise(variant, swing=0.0).modes.frequencies
        rows.append((label, tuple(f"{frequency:.2f}" for frequency in frequencies)))
    return OpenClaim(
        "The frequencies of Fig. 15",
        "P1 is equidistant from three equal cables, so two modes share a frequency there for any mass, area and "
        "modulus: Fig. 15 cannot be at P1. A mass of 100 kg (CAROCA's) with the disc and 102.2 GPa gives the sum of "
        "the squares; the three values then belong to a position some 21 m from P1. The ratio of the frequencies for "
        "the two moduli is reproduced in any case.",
        ("Robot", "f1, Hz", "f2, Hz", "f3, Hz"),
        tuple(rows),
    )
