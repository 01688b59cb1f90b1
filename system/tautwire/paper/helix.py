"""Section 4.1.1: the three-cable robot on its helix, with the linear and with the logarithmic law."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .material import METALLIC_AREA
from .parameters import Parameters, with_law
from .records import Case, Record, Records, helix_case
from .values import Values, largest, relative_difference, turns

Array = NDArray[np.float64]

LAWS = ("logarithmic", "linear")
SAMPLES = 1000
AXES = "xyz"
STEEL = 7850.0  # kg/m^3
# m; the paper reads its differences where curves turn, by at least so much.
PROMINENCE = 1e-3
# When the text says that cables 1 and 2 show the largest differences, in s.
MOMENTS = {1: 27.5, 2: 39.0}


def cases(parameters: Parameters) -> Iterator[tuple[str, Case]]:
    """Both laws on the helix."""
    for law in LAWS:
        robot = with_law(parameters.robots["three"], law)
        yield f"three/{law}", helix_case(robot, parameters.helices["three"], SAMPLES)


def quantities(parameters: Parameters, records: Records) -> Values:
    """What section 4.1.1 says in numbers."""
    logarithmic, linear = records["three/logarithmic"], records["three/linear"]
    values: Values = {
        "helix.start_length": float(np.mean([logarithmic[f"length_{i}"][0] for i in (1, 2, 3)])),
        "helix.start_tension": float(np.mean([logarithmic[f"tension_{i}"][0] for i in (1, 2, 3)])),
        "helix.tension_gap": max(largest(gap(records, "three", f"tension_{i}")) for i in (1, 2, 3)),
        "helix.least_tension": min(float(np.min(logarithmic[f"tension_{i}"])) for i in (1, 2, 3)),
    }
    values["helix.sag"] = _sag(parameters, logarithmic)
    end = parameters.helices["three"].position(np.array([parameters.helices["three"].duration]))[0]
    values |= {f"helix.end_{axis}": float(end[place]) for place, axis in enumerate(AXES)}
    values |= _elongation_gap(logarithmic, linear, 1) | _shares(logarithmic, linear)
    values |= _elongation_gap(logarithmic, linear, 2)
    last = {axis: turns(logarithmic, linear, f"error_{axis}", PROMINENCE)[-1] for axis in AXES}
    values |= {f"helix.error_gap_{axis}": 1e3 * turn.gap for axis, turn in last.items()}
    values["helix.error_gap_relative"] = 100.0 * max(turn.gap / abs(turn.first) for turn in last.values())
    return values


def gap(records: Records, robot: str, name: str) -> Array:
    """What the linear law gives more than the logarithmic one, over time; SI units."""
    return records[f"{robot}/linear"][name] - records[f"{robot}/logarithmic"][name]


def _sag(parameters: Parameters, run: Record) -> float:
    """Largest sag of a taut steel rope of the metallic section over its span, ``w l / (8 T)``, w in N/m."""
    weight = STEEL * METALLIC_AREA * parameters.robots["three"].gravity
    return max(largest(weight * run[f"length_{i}"] / (8.0 * run[f"tension_{i}"])) for i in (1, 2, 3))


def _elongation_gap(logarithmic: Record, linear: Record, cable: int) -> Values:
    """How far apart the laws' elongations are when the text says so (mm), and at which turn they are farthest (s)."""
    name = f"elongation_{cable}"
    farthest = max(turns(logarithmic, linear, name, PROMINENCE), key=lambda turn: turn.gap)
    apart = np.abs(linear[name] - logarithmic[name])
    return {
        f"helix.cable_{cable}_elongation_gap": 1e3 * float(np.interp(MOMENTS[cable], logarithmic.time, apart)),
        f"helix.cable_{cable}_moment": farthest.moment,
    }


def _shares(logarithmic: Record, linear: Record) -> Values:
    """Of cable 1: difference of elongation in % of the linear law's, of strain in % and in % of the logarithmic's."""
    moment = MOMENTS[1]
    return {
        "helix.cable_1_elongation_relative": relative_difference(linear, logarithmic, "elongation_1", moment),
        "helix.cable_1_strain_gap": 100.0 * abs(linear.at("strain_1", moment) - logarithmic.at("strain_1", moment)),
        "helix.cable_1_strain_relative": relative_difference(logarithmic, linear, "strain_1", moment),
    }
