"""Sections 4.2 and 4.3: ramps of the winches with quasi-static and dynamic modulus, with and without damping."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..linear.along import modes_along
from ..materials import PAPER_TABLE, pair_of_row, read_material_table
from ..materials.modulus import Material
from .parameters import Parameters, with_rope, with_start
from .records import Case, Record, Records, ramp_case
from .values import Values, amplitude, dominant_frequency, largest, mean_reduction

# Hz, of the rows of Table 1 that the text takes for each robot.
FREQUENCIES = {"three": 2.0, "caroca": 10.0}
SAMPLES = {"three": 2100, "caroca": 1600}
PLACES = 36
# From here on Figs 14 and 18 show the errors, in s.
SHOWN_FROM = 4.0
# Spans of the three-cable ramp in which the speeds hold, in s: all three winches have reached their peak.
EARLY, LATE = (4.0, 5.5), (5.5, 7.0)


def dynamic_rope(robot: str) -> Material:
    """E' and c of Table 1 at the frequency that the text takes for a robot."""
    return pair_of_row(read_material_table(PAPER_TABLE), FREQUENCIES[robot])


def cases(parameters: Parameters) -> Iterator[tuple[str, Case]]:
    """Each robot's ramp with both moduli, that of the three-cable robot also with damping."""
    for name, ramp in parameters.ramps.items():
        robot, rope = parameters.robots[name], dynamic_rope(name)
        yield f"{name}/static", ramp_case(robot, ramp, SAMPLES[name])
        yield f"{name}/dynamic", ramp_case(with_rope(robot, rope.modulus), ramp, SAMPLES[name])
    robot, rope = parameters.robots["three"], dynamic_rope("three")
    yield "three/damped", ramp_case(with_rope(robot, rope.modulus, rope.damping), parameters.ramps["three"], 2100)


def modes(parameters: Parameters, records: Records) -> dict[str, Record]:
    """The natural frequencies (Hz) along each run with the rope's modulus, ``frequency_1`` ... by ascending value."""
    found = {}
    for name, ramp in parameters.ramps.items():
        robot, rope = with_start(parameters.robots[name], ramp.start), dynamic_rope(name)
        for kind, own in (("static", robot), ("dynamic", with_rope(robot, rope.modulus))):
            run = records[f"{name}/{kind}"]
            every = slice(None, None, (len(run.time) - 1) // PLACES)
            path = np.column_stack([run[axis][every] for axis in "xyz"])
            along = np.sort(modes_along(own, path, times=run.time[every]).frequencies, axis=1)
            series = {f"frequency_{k + 1}": along[:, k] for k in range(along.shape[1])}
            found[f"{name}/modes/{kind}"] = Record(run.time[every], series)
    return found


def quantities(parameters: Parameters, records: Records) -> Values:
    """What sections 4.2 and 4.3 say in numbers."""
    values: Values = {}
    for name in parameters.ramps:
        values |= _robot(name, records)
    static = parameters.robots["three"].cables[0].modulus
    values["ramp.three.stiffening"] = 100.0 * (dynamic_rope("three").modulus / static - 1.0)
    values["ramp.three.frequency_dynamic"] = records["three/modes/dynamic"]["frequency_1"][0]
    values["ramp.three.frequency_static"] = records["three/modes/static"]["frequency_1"][0]
    values["ramp.three.frequency_ratio"] = (
        records["three/modes/dynamic"]["frequency_1"][0] / records["three/modes/static"]["frequency_1"][0]
    )
    return values | _damping(parameters, records)


def amplitude_kept(run: Record) -> float:
    """The swing of r1 late in the hold of the three-cable ramp, in % of that early in it."""
    frequency = dominant_frequency(run.time, run["elongation_1"])
    early, late = (amplitude(run.time, run["elongation_1"], frequency, *span) for span in (EARLY, LATE))
    return 100.0 * late / early


def _robot(name: str, records: Records) -> Values:
    static, dynamic = records[f"{name}/static"], records[f"{name}/dynamic"]
    shown = dynamic.time >= (SHOWN_FROM if name == "three" else 0.0)
    swinging = "elongation_1" if name == "three" else "elongation_2"
    own = f"ramp.{name}"
    values: Values = {
        f"{own}.frequency": dominant_frequency(dynamic.time, dynamic[swinging]),
        f"{own}.modulus": 1e-9 * dynamic_rope(name).modulus,
        f"{own}.error_relative": mean_reduction(static, dynamic, "error_norm"),
    }
    for axis in "xyz":
        values[f"{own}.end_{axis}"] = dynamic[axis][-1]
        values[f"{own}.gap_{axis}"] = 1e3 * largest((static[axis] - dynamic[axis])[shown])
    return values


def _damping(parameters: Parameters, records: Records) -> Values:
    undamped, damped = records["three/dynamic"], records["three/damped"]

    return {
        "damping.coefficient": 1e-9 * dynamic_rope("three").damping,
        "damping.modulus": 1e-9 * dynamic_rope("three").modulus,
        "damping.frequency": dominant_frequency(undamped.time, undamped["elongation_1"]),
        "damping.first_phase": parameters.ramps["three"].reached,
        "damping.duration": parameters.ramps["three"].duration,
        "damping.energy_made": 100.0 * undamped.made,
        "damping.amplitude_kept": 100.0 * amplitude_kept(damped) / amplitude_kept(undamped),
    }
