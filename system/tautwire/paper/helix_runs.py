"""Section 4.1.1: the three-cable robot on its helix, with the linear and with the logarithmic law."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

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
SAMPLE_COUNT = 1000
AXES = "xyz"
STEEL_DENSITY = 7850.0  # kg/m^3
# m, least prominence of the turning points at which the paper reads its differences.
TURN_PROMINENCE = 1e-3
# s, times at which the text says that cables 1 and 2 show the largest differences.
LARGEST_DIFFERENCE_TIMES = {1: 27.5, 2: 39.0}


def cases(parameters: PaperParameters) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of both laws on the helix."""
    for law in TENSION_LAWS:
        robot = with_law(parameters.robots["three"], law)
        yield f"three/{law}", path_case(robot, parameters.helices["three"], SAMPLE_COUNT)


def quantities(parameters: PaperParameters, records: Records) -> ClaimValues:
    """Numbers of section 4.1.1."""
    logarithmic, linear = records["three/logarithmic"], records["three/linear"]
    values: ClaimValues = {
        "helix.start_length": float(np.mean([logarithmic[f"length_{i}"][0] for i in (1, 2, 3)])),
        "helix.start_tension": float(np.mean([logarithmic[f"tension_{i}"][0] for i in (1, 2, 3)])),
        "helix.tension_gap": max(max_abs(law_difference(records, "three", f"tension_{i}")) for i in (1, 2, 3)),
        "helix.least_tension": min(float(np.min(logarithmic[f"tension_{i}"])) for i in (1, 2, 3)),
    }
    values["helix.sag"] = _max_relative_sag(parameters, logarithmic)
    end = parameters.helices["three"].position(np.array([parameters.helices["three"].duration]))[0]
    values |= {f"helix.end_{axis}": float(end[index]) for index, axis in enumerate(AXES)}
    values |= _elongation_gap(logarithmic, linear, 1) | _relative_differences(logarithmic, linear)
    values |= _elongation_gap(logarithmic, linear, 2)
    last_turns = {axis: turning_points(logarithmic, linear, f"error_{axis}", TURN_PROMINENCE)[-1] for axis in AXES}
    values |= {f"helix.error_gap_{axis}": 1e3 * turn.gap for axis, turn in last_turns.items()}
    values["helix.error_gap_relative"] = 100.0 * max(turn.gap / abs(turn.first) for turn in last_turns.values())
    return values


def law_difference(records: Records, robot: str, name: str) -> Array:
    """Difference of the linear law from the logarithmic one over time; SI units."""
    return records[f"{robot}/linear"][name] - records[f"{robot}/logarithmic"][name]


def _max_relative_sag(parameters: PaperParameters, run: SimulationRecord) -> float:
    """Largest sag of a taut steel rope of the metallic section over its span, ``w l / (8 T)``, w in N/m."""
    weight = STEEL_DENSITY * METALLIC_AREA * parameters.robots["three"].gravity
    return max(max_abs(weight * run[f"length_{i}"] / (8.0 * run[f"tension_{i}"])) for i in (1, 2, 3))


def _elongation_gap(logarithmic: SimulationRecord, linear: SimulationRecord, cable: int) -> ClaimValues:
    """Difference of the laws' elongations at the text's time (mm), and the turning point of the largest (s)."""
    name = f"elongation_{cable}"
    farthest = max(turning_points(logarithmic, linear, name, TURN_PROMINENCE), key=lambda turn: turn.gap)
    difference = np.abs(linear[name] - logarithmic[name])
    return {
        f"helix.cable_{cable}_elongation_gap": 1e3
        * float(np.interp(LARGEST_DIFFERENCE_TIMES[cable], logarithmic.time, difference)),
        f"helix.cable_{cable}_moment": farthest.time,
    }


def _relative_differences(logarithmic: SimulationRecord, linear: SimulationRecord) -> ClaimValues:
    """Differences of cable 1: elongation in % of the linear law's, strain in % and in % of the logarithmic law's."""
    time = LARGEST_DIFFERENCE_TIMES[1]
    return {
        "helix.cable_1_elongation_relative": relative_difference(linear, logarithmic, "elongation_1", time),
        "helix.cable_1_strain_gap": 100.0 * abs(linear.at("strain_1", time) - logarithmic.at("strain_1", time)),
        "helix.cable_1_strain_relative": relative_difference(logarithmic, linear, "strain_1", time),
    }
