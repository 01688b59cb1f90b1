"""Section 4.1: all robots on their helices, with the linear and with the logarithmic law; Table 2."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, Robot
from .paper_parameters import PaperParameters, with_law
from .rope_tests import METALLIC_AREA
from .simulation_records import (
    ClaimValues,
    Records,
    SimulationCase,
    SimulationRecord,
    max_abs,
    path_case,
    relative_difference,
    turning_points,
)

Array = NDArray[np.float64]

TENSION_LAWS = ("logarithmic", "linear")
SAMPLE_COUNTS = {"three": 1000, "caroca": 800, "fast": 800}
LARGE_ROBOTS = ("caroca", "fast")
STEEL_DENSITY = 7850.0  # kg/m^3
# m, least prominence of the turning points at which the paper reads its differences.
TURN_PROMINENCE = 1e-3
# s, times at which the text says that cables 1 and 2 of three, and FAST, show the largest differences.
LARGEST_DIFFERENCE_TIMES = {1: 27.5, 2: 39.0}
FAST_DIFFERENCE_TIME = 38.0
# Series of the large robots' cable that the paper plots and takes its numbers from.
ELONGATION, STRAIN, TENSION = "elongation_2", "strain_2", "tension_2"


def cases(parameters: PaperParameters) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of both laws on the helix of each robot that the parameter set has."""
    for name, samples in SAMPLE_COUNTS.items():
        if name in parameters.robots:
            for law in TENSION_LAWS:
                robot = with_law(parameters.robots[name], law)
                yield f"{name}/{law}", path_case(robot, parameters.helices[name], samples)


def quantities(parameters: PaperParameters, records: Records) -> ClaimValues:
    """Numbers of section 4.1 and its Table 2."""
    values = _three_cable_values(parameters, records) | _caroca_values(records)
    for name, path in parameters.helices.items():
        end = path.position(np.array([path.duration]))[0]
        prefix = "helix" if name == "three" else name
        values |= {f"{prefix}.end_{axis}": float(end[index]) for index, axis in enumerate(AXES)}
    for name in LARGE_ROBOTS:
        if name in parameters.robots:
            values |= _table_2_values(name, parameters.robots[name], records)
    return values | _fast_values(records) if "fast" in parameters.robots else values


def law_difference(records: Records, robot: str, name: str) -> Array:
    """Difference of the linear law from the logarithmic one over time; SI units."""
    return records[f"{robot}/linear"][name] - records[f"{robot}/logarithmic"][name]


def _three_cable_values(parameters: PaperParameters, records: Records) -> ClaimValues:
    """Numbers of section 4.1.1."""
    logarithmic, linear = records["three/logarithmic"], records["three/linear"]
    values: ClaimValues = {
        "helix.start_length": float(np.mean([logarithmic[f"length_{i}"][0] for i in (1, 2, 3)])),
        "helix.start_tension": float(np.mean([logarithmic[f"tension_{i}"][0] for i in (1, 2, 3)])),
        "helix.tension_gap": max(max_abs(law_difference(records, "three", f"tension_{i}")) for i in (1, 2, 3)),
        "helix.least_tension": min(float(np.min(logarithmic[f"tension_{i}"])) for i in (1, 2, 3)),
        "helix.sag": _max_relative_sag(parameters, logarithmic),
    }
    values |= _elongation_gap(records, 1) | _relative_differences(logarithmic, linear) | _elongation_gap(records, 2)
    last_turns = {axis: turning_points(logarithmic, linear, f"error_{axis}", TURN_PROMINENCE)[-1] for axis in AXES}
    values |= {f"helix.error_gap_{axis}": 1e3 * turn.gap for axis, turn in last_turns.items()}
    values["helix.error_gap_relative"] = 100.0 * max(turn.gap / abs(turn.first) for turn in last_turns.values())
    return values


def _max_relative_sag(parameters: PaperParameters, run: SimulationRecord) -> float:
    """Largest sag of a taut steel rope of the metallic section over its span, ``w l / (8 T)``, w in N/m."""
    weight = STEEL_DENSITY * METALLIC_AREA * parameters.robots["three"].gravity
    return max(max_abs(weight * run[f"length_{i}"] / (8.0 * run[f"tension_{i}"])) for i in (1, 2, 3))


def _elongation_gap(records: Records, cable: int) -> ClaimValues:
    """Difference of the laws' elongations at the text's time (mm), and the turning point of the largest (s)."""
    name, time = f"elongation_{cable}", records["three/logarithmic"].time
    turns = turning_points(records["three/logarithmic"], records["three/linear"], name, TURN_PROMINENCE)
    difference = np.abs(law_difference(records, "three", name))
    return {
        f"helix.cable_{cable}_elongation_gap": 1e3
        * float(np.interp(LARGEST_DIFFERENCE_TIMES[cable], time, difference)),
        f"helix.cable_{cable}_moment": max(turns, key=lambda turn: turn.gap).time,
    }


def _relative_differences(logarithmic: SimulationRecord, linear: SimulationRecord) -> ClaimValues:
    """Differences of cable 1: elongation in % of the linear law's, strain in % and in % of the logarithmic law's."""
    time = LARGEST_DIFFERENCE_TIMES[1]
    return {
        "helix.cable_1_elongation_relative": relative_difference(linear, logarithmic, "elongation_1", time),
        "helix.cable_1_strain_gap": 100.0 * abs(linear.at("strain_1", time) - logarithmic.at("strain_1", time)),
        "helix.cable_1_strain_relative": relative_difference(logarithmic, linear, "strain_1", time),
    }


def _caroca_values(records: Records) -> ClaimValues:
    logarithmic, linear = records["caroca/logarithmic"], records["caroca/linear"]
    end = float(logarithmic.time[-1])
    elongation_difference, strain_difference, error_difference = (
        np.abs(law_difference(records, "caroca", name)) for name in (ELONGATION, STRAIN, "error_norm")
    )
    return {
        "caroca.strain_gap": 100.0 * max_abs(strain_difference),
        "caroca.strain_relative": 100.0 * max_abs(strain_difference) / max_abs(logarithmic[STRAIN]),
        "caroca.elongation_gap": 1e3 * float(elongation_difference[-1]),
        "caroca.elongation_relative": relative_difference(linear, logarithmic, ELONGATION, end),
        "caroca.moment": float(logarithmic.time[np.argmax(elongation_difference)]),
        "caroca.error_gap": 1e3 * float(error_difference[-1]),
        "caroca.error_relative": 100.0 * float(error_difference[-1]) / linear.at("error_norm", end),
    }


def _fast_values(records: Records) -> ClaimValues:
    logarithmic, linear = records["fast/logarithmic"], records["fast/linear"]
    elongation_difference, strain_difference = (
        np.abs(law_difference(records, "fast", name)) for name in (ELONGATION, STRAIN)
    )
    # Early on both are near zero, where their quotient has no meaning.
    late = linear.time >= 0.5 * linear.time[-1]
    error_difference = np.linalg.norm([law_difference(records, "fast", f"error_{axis}") for axis in AXES], axis=0)
    return {
        "fast.elongation_gap": 1e3 * float(np.interp(FAST_DIFFERENCE_TIME, logarithmic.time, elongation_difference)),
        "fast.moment": float(logarithmic.time[np.argmax(elongation_difference)]),
        "fast.elongation_relative": relative_difference(linear, logarithmic, ELONGATION, FAST_DIFFERENCE_TIME),
        "fast.tension_gap": max_abs(law_difference(records, "fast", TENSION)),
        "fast.strain_gap": 100.0 * max_abs(strain_difference),
        "fast.strain_relative": 100.0 * float(np.max(strain_difference[late] / linear[STRAIN][late])),
        "fast.error_gap": 1e3 * float(error_difference[-1]),
        "fast.error_moment": float(logarithmic.time[np.argmax(error_difference)]),
    }


def _table_2_values(name: str, robot: Robot, records: Records) -> ClaimValues:
    """Table 2: size of the frame (m), mean cable length at P1 (m), largest tension of the run (kN)."""
    anchors, run = np.array(robot.anchors), records[f"{name}/logarithmic"]
    return {
        f"{name}.height": float(np.max(anchors[:, 2]) if name == "caroca" else np.max(anchors[:, 2]) - run["z"][0]),
        f"{name}.width": float(np.max(np.ptp(anchors[:, :2], axis=0))),
        f"{name}.cable_length": float(np.mean([run[f"length_{i}"][0] for i in robot.cable_numbers])),
        f"{name}.largest_tension": 1e-3 * max(max_abs(run[f"tension_{i}"]) for i in robot.cable_numbers),
    }
