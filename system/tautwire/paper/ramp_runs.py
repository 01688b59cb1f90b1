"""Sections 4.2 and 4.3: ramps of the winches with quasi-static and dynamic modulus, with and without damping."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..linear.modes_along_path import modes_along
from ..materials import PAPER_TABLE, pair_of_row, read_material_table
from ..materials.viscoelastic_model import Material
from ..recordings.start_position import with_start
from .paper_parameters import PaperParameters, with_rope
from .simulation_records import (
    ClaimValues,
    Records,
    SimulationCase,
    SimulationRecord,
    amplitude,
    dominant_frequency,
    max_abs,
    mean_reduction,
    ramp_case,
)

# Hz, frequencies of the rows of Table 1 that the text takes for each robot.
DYNAMIC_FREQUENCIES = {"three": 2.0, "caroca": 10.0}
SAMPLE_COUNTS = {"three": 2100, "caroca": 1600}
MODE_INTERVALS = 36
# s, time from which on Figs 14 and 18 show the errors.
PLOT_START_TIME = 4.0
# s, spans of the three-cable ramp at constant speed: all three winches have reached their peak.
EARLY_SPAN, LATE_SPAN = (4.0, 5.5), (5.5, 7.0)


def dynamic_rope(robot: str) -> Material:
    """E' and c of Table 1 at the frequency that the text takes for a robot."""
    return pair_of_row(read_material_table(PAPER_TABLE), DYNAMIC_FREQUENCIES[robot])


def cases(parameters: PaperParameters) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of each robot's ramp with both moduli, that of the three-cable robot also with damping."""
    for name, ramp in parameters.ramps.items():
        robot, rope = parameters.robots[name], dynamic_rope(name)
        yield f"{name}/static", ramp_case(robot, ramp, SAMPLE_COUNTS[name])
        yield f"{name}/dynamic", ramp_case(with_rope(robot, rope.modulus), ramp, SAMPLE_COUNTS[name])
    robot, rope = parameters.robots["three"], dynamic_rope("three")
    yield "three/damped", ramp_case(with_rope(robot, rope.modulus, rope.damping), parameters.ramps["three"], 2100)


def mode_records(parameters: PaperParameters, records: Records) -> dict[str, SimulationRecord]:
    """The natural frequencies (Hz) along each run with the rope's modulus, ``frequency_1`` ... by ascending value."""
    frequency_records = {}
    for name, ramp in parameters.ramps.items():
        robot, rope = with_start(parameters.robots[name], ramp.start), dynamic_rope(name)
        for kind, variant in (("static", robot), ("dynamic", with_rope(robot, rope.modulus))):
            run = records[f"{name}/{kind}"]
            rows = slice(None, None, (len(run.time) - 1) // MODE_INTERVALS)
            path = np.column_stack([run[axis][rows] for axis in "xyz"])
            frequencies = np.sort(modes_along(variant, path, times=run.time[rows]).frequencies, axis=1)
            series = {f"frequency_{k + 1}": frequencies[:, k] for k in range(frequencies.shape[1])}
            frequency_records[f"{name}/modes/{kind}"] = SimulationRecord(run.time[rows], series)
    return frequency_records


def quantities(parameters: PaperParameters, records: Records) -> ClaimValues:
    """Numbers of sections 4.2 and 4.3."""
    values: ClaimValues = {}
    for name in parameters.ramps:
        values |= _ramp_values(name, records)
    static = parameters.robots["three"].cables[0].modulus
    values["ramp.three.stiffening"] = 100.0 * (dynamic_rope("three").modulus / static - 1.0)
    dynamic, quasi_static = (records[f"three/modes/{kind}"]["frequency_1"][0] for kind in ("dynamic", "static"))
    values["ramp.three.frequency_dynamic"], values["ramp.three.frequency_static"] = dynamic, quasi_static
    values["ramp.three.frequency_ratio"] = dynamic / quasi_static
    return values | _damping_values(parameters, records)


def remaining_amplitude(run: SimulationRecord) -> float:
    """Amplitude of r1 late at constant speed of the three-cable ramp, in % of that early in it."""
    frequency = dominant_frequency(run.time, run["elongation_1"])
    early, late = (amplitude(run.time, run["elongation_1"], frequency, *span) for span in (EARLY_SPAN, LATE_SPAN))
    return 100.0 * late / early


def _ramp_values(name: str, records: Records) -> ClaimValues:
    static, dynamic = records[f"{name}/static"], records[f"{name}/dynamic"]
    plotted = dynamic.time >= (PLOT_START_TIME if name == "three" else 0.0)
    swing_series = "elongation_1" if name == "three" else "elongation_2"
    prefix = f"ramp.{name}"
    values: ClaimValues = {
        f"{prefix}.frequency": dominant_frequency(dynamic.time, dynamic[swing_series]),
        f"{prefix}.modulus": 1e-9 * dynamic_rope(name).modulus,
        f"{prefix}.error_relative": mean_reduction(static, dynamic, "error_norm"),
    }
    for axis in "xyz":
        values[f"{prefix}.end_{axis}"] = dynamic[axis][-1]
        values[f"{prefix}.gap_{axis}"] = 1e3 * max_abs((static[axis] - dynamic[axis])[plotted])
    return values


def _damping_values(parameters: PaperParameters, records: Records) -> ClaimValues:
    undamped, damped = records["three/dynamic"], records["three/damped"]
    return {
        "damping.coefficient": 1e-9 * dynamic_rope("three").damping,
        "damping.modulus": 1e-9 * dynamic_rope("three").modulus,
        "damping.frequency": dominant_frequency(undamped.time, undamped["elongation_1"]),
        "damping.first_phase": parameters.ramps["three"].peak_time,
        "damping.duration": parameters.ramps["three"].duration,
        "damping.energy_made": 100.0 * undamped.coupling_energy_share,
        "damping.amplitude_kept": 100.0 * remaining_amplitude(damped) / remaining_amplitude(undamped),
    }
