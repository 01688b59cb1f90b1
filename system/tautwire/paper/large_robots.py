"""Section 4.1.2: CAROCA and FAST on their helices, with the linear and with the logarithmic law; Table 2."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..robots.robot import Robot
from .helix import LAWS, gap
from .parameters import Parameters, with_law
from .records import Case, Records, helix_case
from .values import Values, largest, relative_difference

SAMPLES = {"caroca": 800, "fast": 800}
# The cable that the paper plots and its numbers are about.
SHOWN = 2
# When the text says that FAST shows its largest difference, in s.
FAST_MOMENT = 38.0


def cases(parameters: Parameters) -> Iterator[tuple[str, Case]]:
    """Both laws on the helix of each robot whose parameters are known."""
    for name, samples in SAMPLES.items():
        if name in parameters.robots:
            for law in LAWS:
                robot = with_law(parameters.robots[name], law)
                yield f"{name}/{law}", helix_case(robot, parameters.helices[name], samples)


def quantities(parameters: Parameters, records: Records) -> Values:
    """What section 4.1.2 and its Table 2 say in numbers."""
    values = _caroca(records)
    for name in SAMPLES:
        if name in parameters.helices:
            path = parameters.helices[name]
            end = path.position(np.array([path.duration]))[0]
            values |= {f"{name}.end_{axis}": float(end[place]) for place, axis in enumerate("xyz")}
        if name in parameters.robots:
            values |= _table_2(name, parameters.robots[name], records)
    if "fast" in parameters.robots:
        values |= _fast(records)
    return values


def _caroca(records: Records) -> Values:
    logarithmic, linear = records["caroca/logarithmic"], records["caroca/linear"]
    elongation, strain = f"elongation_{SHOWN}", f"strain_{SHOWN}"
    end = float(logarithmic.time[-1])
    strains = np.abs(gap(records, "caroca", strain))
    errors = np.abs(gap(records, "caroca", "error_norm"))
    return {
        "caroca.strain_gap": 100.0 * largest(strains),
        "caroca.strain_relative": 100.0 * largest(strains) / largest(logarithmic[strain]),
        "caroca.elongation_gap": 1e3 * abs(float(gap(records, "caroca", elongation)[-1])),
        "caroca.elongation_relative": relative_difference(linear, logarithmic, elongation, end),
        "caroca.moment": float(logarithmic.time[np.argmax(np.abs(gap(records, "caroca", elongation)))]),
        "caroca.error_gap": 1e3 * float(errors[-1]),
        "caroca.error_relative": 100.0 * float(errors[-1]) / linear.at("error_norm", end),
    }


def _fast(records: Records) -> Values:
    logarithmic, linear = records["fast/logarithmic"], records["fast/linear"]
    elongation, strain = f"elongation_{SHOWN}", f"strain_{SHOWN}"
    apart = np.abs(gap(records, "fast", elongation))
    strains = np.abs(gap(records, "fast", strain))
    # Early on both are next to nothing, and so is what their quotient says.
    late = linear.time >= 0.5 * linear.time[-1]
    errors = np.linalg.norm([gap(records, "fast", f"error_{axis}") for axis in "xyz"], axis=0)
    return {
        "fast.elongation_gap": 1e3 * float(np.interp(FAST_MOMENT, logarithmic.time, apart)),
        "fast.moment": float(logarithmic.time[np.argmax(apart)]),
        "fast.elongation_relative": relative_difference(linear, logarithmic, elongation, FAST_MOMENT),
        "fast.tension_gap": largest(gap(records, "fast", f"tension_{SHOWN}")),
        "fast.strain_gap": 100.0 * largest(strains),
        "fast.strain_relative": 100.0 * float(np.max(strains[late] / linear[strain][late])),
        "fast.error_gap": 1e3 * float(errors[-1]),
        "fast.error_moment": float(logarithmic.time[np.argmax(errors)]),
    }


def _table_2(name: str, robot: Robot, records: Records) -> Values:
    """Size of the frame (m), mean cable length at P1 (m), largest tension of the run (kN)."""
    anchors = np.array(robot.anchors)
    count, run = robot.cable_count, records[f"{name}/logarithmic"]
    return {
        f"{name}.height": float(np.max(anchors[:, 2]) if name == "caroca" else np.max(anchors[:, 2]) - run["z"][0]),
        f"{name}.width": float(np.max(np.ptp(anchors[:, :2], axis=0))),
        f"{name}.cable_length": float(np.mean([run[f"length_{i}"][0] for i in range(1, count + 1)])),
        f"{name}.largest_tension": 1e-3 * max(largest(run[f"tension_{i}"]) for i in range(1, count + 1)),
    }
