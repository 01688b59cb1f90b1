"""Section 4.1.2: CAROCA and FAST on their helices, with the linear and with the logarithmic law; Table 2."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..robot.schema import Robot
from .helix_runs import TENSION_LAWS, law_difference
from .paper_parameters import PaperParameters, with_law
from .simulation_records import ClaimValues, Records, SimulationCase, max_abs, path_case, relative_difference

SAMPLE_COUNTS = {"caroca": 800, "fast": 800}
# The cable that the paper plots and takes its numbers from.
PLOTTED_CABLE = 2
# s, time at which the text says that FAST shows its largest difference.
FAST_DIFFERENCE_TIME = 38.0


def cases(parameters: PaperParameters) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of both laws on the helix of each robot that the parameter set has."""
    for name, samples in SAMPLE_COUNTS.items():
        if name in parameters.robots:
            for law in TENSION_LAWS:
                robot = with_law(parameters.robots[name], law)
                yield f"{name}/{law}", path_case(robot, parameters.helices[name], samples)


def quantities(parameters: PaperParameters, records: Records) -> ClaimValues:
    """Numbers of section 4.1.2 and its Table 2."""
    values = _caroca_values(records)
    for name in SAMPLE_COUNTS:
        if name in parameters.helices:
            path = parameters.helices[name]
            end = path.position(np.array([path.duration]))[0]
            values |= {f"{name}.end_{axis}": float(end[index]) for index, axis in enumerate("xyz")}
        if name in parameters.robots:
            values |= _table_2_values(name, parameters.robots[name], records)
    if "fast" in parameters.robots:
        values |= _fast_values(records)
    return values


def _caroca_values(records: Records) -> ClaimValues:
    logarithmic, linear = records["caroca/logarithmic"], records["caroca/linear"]
    elongation, strain = f"elongation_{PLOTTED_CABLE}", f"strain_{PLOTTED_CABLE}"
    end = float(logarithmic.time[-1])
    strain_difference = np.abs(law_difference(records, "caroca", strain))
    error_difference = np.abs(law_difference(records, "caroca", "error_norm"))
    return {
        "caroca.strain_gap": 100.0 * max_abs(strain_difference),
        "caroca.strain_relative": 100.0 * max_abs(strain_difference) / max_abs(logarithmic[strain]),
        "caroca.elongation_gap": 1e3 * abs(float(law_difference(records, "caroca", elongation)[-1])),
        "caroca.elongation_relative": relative_difference(linear, logarithmic, elongation, end),
        "caroca.moment": float(logarithmic.time[np.argmax(np.abs(law_difference(records, "caroca", elongation)))]),
        "caroca.error_gap": 1e3 * float(error_difference[-1]),
        "caroca.error_relative": 100.0 * float(error_difference[-1]) / linear.at("error_norm", end),
    }


def _fast_values(records: Records) -> ClaimValues:
    logarithmic, linear = records["fast/logarithmic"], records["fast/linear"]
    elongation, strain = f"elongation_{PLOTTED_CABLE}", f"strain_{PLOTTED_CABLE}"
    difference = np.abs(law_difference(records, "fast", elongation))
    strain_difference = np.abs(law_difference(records, "fast", strain))
    # Early on both are near zero, where their quotient has no meaning.
    late = linear.time >= 0.5 * linear.time[-1]
    error_difference = np.linalg.norm([law_difference(records, "fast", f"error_{axis}") for axis in "xyz"], axis=0)
    return {
        "fast.elongation_gap": 1e3 * float(np.interp(FAST_DIFFERENCE_TIME, logarithmic.time, difference)),
        "fast.moment": float(logarithmic.time[np.argmax(difference)]),
        "fast.elongation_relative": relative_difference(linear, logarithmic, elongation, FAST_DIFFERENCE_TIME),
        "fast.tension_gap": max_abs(law_difference(records, "fast", f"tension_{PLOTTED_CABLE}")),
        "fast.strain_gap": 100.0 * max_abs(strain_difference),
        "fast.strain_relative": 100.0 * float(np.max(strain_difference[late] / linear[strain][late])),
        "fast.error_gap": 1e3 * float(error_difference[-1]),
        "fast.error_moment": float(logarithmic.time[np.argmax(error_difference)]),
    }


def _table_2_values(name: str, robot: Robot, records: Records) -> ClaimValues:
    """Table 2: size of the frame (m), mean cable length at P1 (m), largest tension of the run (kN)."""
    anchors = np.array(robot.anchors)
    count, run = robot.cable_count, records[f"{name}/logarithmic"]
    return {
        f"{name}.height": float(np.max(anchors[:, 2]) if name == "caroca" else np.max(anchors[:, 2]) - run["z"][0]),
        f"{name}.width": float(np.max(np.ptp(anchors[:, :2], axis=0))),
        f"{name}.cable_length": float(np.mean([run[f"length_{i}"][0] for i in range(1, count + 1)])),
        f"{name}.largest_tension": 1e-3 * max(max_abs(run[f"tension_{i}"]) for i in range(1, count + 1)),
    }
