"""Tensile and dynamic tests of section 3, run on one cable FMU in a tensile machine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from ..cosimulation import Component
from ..fmus.fmu_variables import INPUT_TIME
from ..fmus.packaging import build_fmus
from ..materials import PAPER_TABLE, RobotMaterial, read_material_table, robot_material, with_material
from ..materials.material_table import MaterialRow, MaterialTable
from ..materials.model_selection import best_linear_fit
from ..materials.modulus_observations import observations_from_table
from ..robot.schema import Cable, Platform, Robot, Sensors
from .simulation_records import ClaimValues

Array = NDArray[np.float64]

GRAVITY = 9.81
# rad, inclination of the three ropes from the vertical, so that statics gives each the same tension.
ROPE_INCLINATION = math.pi / 4.0

# Sec. 3.1 and 3.2.
BREAKING_FORCE = 10.29e3  # N
ROPE_DIAMETER = 4e-3  # m
ROPE_LENGTH = 0.35  # m, free between the grips
METALLIC_AREA = 7.1675e-6  # m^2, Ac
DISC_AREA = math.pi * (0.5 * ROPE_DIAMETER) ** 2  # m^2, Sc
TENSILE_SPEED = 0.05e-3  # m/s
FORCE_ERROR, ELONGATION_ERROR = 1.0, 0.03e-3  # N, m
MIN_FORCE_SHARE, MAX_FORCE_SHARE = 0.1, 0.3  # shares of the breaking force, Eq. 7
DYNAMIC_PRELOAD = 1500.0  # N
# Tension of the rope at the start of the tensile test, in N.
TENSILE_PRELOAD = 1.0
SAMPLES_PER_PERIOD, TRANSIENT_DURATION = 48, 10.0


@dataclass(frozen=True)
class RopeTest:
    """A test specimen: rope of ``area`` (m^2) and ``length`` (m) between grips, under ``preload`` (N) at the start."""

    area: float
    length: float
    preload: float


@dataclass(frozen=True)
class RopeTestRecord:
    """Record of a test: ``elongation`` (N,) in m of the grips since the start, and ``load`` (N,) in N."""

    time: Array
    elongation: Array
    load: Array


def run_rope_test(test: RopeTest, rope: RobotMaterial, programs: Sequence[tuple[Array, Array]]) -> list[RopeTestRecord]:
    """Run programs of ``(time, speed of the grip)``, in s and m/s, each from the start, on one cable FMU.

    Speeds are linear between samples. Raises ComponentError where the FMU fails.
    """
    with TemporaryDirectory(prefix="tautwire-rope-") as folder:
        fmu = build_fmus(_tensile_machine(test, rope), Path(folder)).cables[0]
        return [_run_program(fmu, test, time, speed) for time, speed in programs]


def _tensile_machine(test: RopeTest, rope: RobotMaterial) -> Robot:
    """A robot each of whose three ropes is as long as the tested one and as tight."""
    angles = 2.0 * math.pi / 3.0 * np.arange(3)
    horizontal, vertical = test.length * math.sin(ROPE_INCLINATION), test.length * math.cos(ROPE_INCLINATION)
    cables = tuple(
        Cable(
            (horizontal * math.cos(a), horizontal * math.sin(a), vertical),
            rope.modulus,
            test.area,
            rope.damping,
            "logarithmic",
        )
        for a in angles.tolist()
    )
    mass = 3.0 * test.preload * math.cos(ROPE_INCLINATION) / GRAVITY
    plain = Robot("tensile machine", GRAVITY, Platform(mass, (0.0, 0.0, 0.0)), None, Sensors(), cables)
    return with_material(plain, rope)


def _run_program(fmu: Path, test: RopeTest, time: Array, speed: Array) -> RopeTestRecord:
    accelerations = np.append(np.diff(speed) / np.diff(time), 0.0)
    load = np.empty(len(time))
    with Component("rope", fmu) as component:
        inputs = component.block((INPUT_TIME, "winch_speed", "winch_acceleration"))
        output = component.block(("tension",))
        component.initialize(float(time[0]), {})
        component.run()
        for row in range(len(time)):
            if row:
                inputs.values[:] = time[row], speed[row], accelerations[row - 1]
                component.write(inputs)
                component.step(float(time[row - 1]), float(time[row] - time[row - 1]))
            inputs.values[:] = time[row], speed[row], accelerations[row]
            component.write(inputs)
            component.read(output)
            load[row] = output.values[0]
    return RopeTestRecord(time, np.asarray(cumulative_trapezoid(speed, time, initial=0)), load)


@dataclass(frozen=True)
class RopeTestRuns:
    """Rope tests of section 3 with one parameter set: ``tensile`` up and down again, ``loops`` by frequency in Hz."""

    table: MaterialTable
    rope: RobotMaterial
    tensile: RopeTestRecord
    loops: Mapping[float, RopeTestRecord]


def printed_rope() -> RobotMaterial:
    """The rope as simulated in section 4.1: the quasi-static modulus, and nothing else."""
    table = read_material_table(PAPER_TABLE)
    return RobotMaterial(table.static_rows[0].quantities["storage_modulus"].value, 0.0, ())


def relaxing_rope() -> RobotMaterial:
    """The best fit to all rows of Table 1 and the static test of those ropes that a robot file can hold."""
    table = read_material_table(PAPER_TABLE)
    observations = observations_from_table(table, table.modulus_pairs()[0], 0.0, 1.0).with_static_rows(table)
    return robot_material(best_linear_fit(observations).material)


def run_tensile_and_dynamic_tests(rope: RobotMaterial) -> RopeTestRuns:
    """Run both tests of section 3 on one rope."""
    table = read_material_table(PAPER_TABLE)
    duration = ROPE_LENGTH * MAX_FORCE_SHARE * BREAKING_FORCE / (METALLIC_AREA * rope.modulus) / TENSILE_SPEED
    time = np.linspace(0.0, 2.0 * duration, 401)
    up_and_down = np.where(time < duration, TENSILE_SPEED, -TENSILE_SPEED)
    (tensile,) = run_rope_test(RopeTest(METALLIC_AREA, ROPE_LENGTH, TENSILE_PRELOAD), rope, [(time, up_and_down)])
    programs = [_sine_program(row) for row in table.rows]
    records = run_rope_test(RopeTest(METALLIC_AREA, ROPE_LENGTH, DYNAMIC_PRELOAD), rope, programs)
    loops = {row.frequency: _last_period(row.frequency, run) for row, run in zip(table.rows, records, strict=True)}
    return RopeTestRuns(table, rope, tensile, loops)


def rope_test_values(runs: RopeTestRuns, error_share: float) -> ClaimValues:
    """Numbers of section 3 without Table 1; ``error_share`` as in :class:`PaperParameters`."""
    modulus = tensile_modulus(runs.tensile, METALLIC_AREA)
    relative = tensile_modulus_error(runs.tensile, error_share)
    sizes = {row.frequency: row.quantities for row in runs.table.rows}
    stiffness = [sizes[f]["dynamic_modulus"].value for f in sizes if f >= 1.0]
    storage = {f: row["dynamic_modulus"].value * math.cos(row["phase"].value) for f, row in sizes.items()}
    return {
        "material.test_force": MAX_FORCE_SHARE * BREAKING_FORCE,
        "material.length_over_diameter": ROPE_LENGTH / ROPE_DIAMETER,
        "material.modulus": 1e-9 * modulus,
        "material.modulus_disc": 1e-9 * tensile_modulus(runs.tensile, DISC_AREA),
        "material.modulus_error": 1e-9 * modulus * relative,
        "material.modulus_disc_error": 1e-9 * tensile_modulus(runs.tensile, DISC_AREA) * relative,
        "material.rise": 1e-9 * (storage[1.0] - storage[0.1]),
        "material.constant_above": 1e-9 * (max(stiffness) - min(stiffness)),
        "material.load_amplitude": sizes[0.1]["stress_amplitude"].value * METALLIC_AREA,
    }


def tensile_modulus(test: RopeTestRecord, area: float) -> float:
    """Tensile modulus ``E = l_c (F30 - F10) / (A (x2 - x1))`` on the loading path, in Pa; Eq. 7."""
    low, high = MIN_FORCE_SHARE * BREAKING_FORCE, MAX_FORCE_SHARE * BREAKING_FORCE
    x1, x2 = secant_elongations(test)
    return ROPE_LENGTH * (high - low) / (area * (x2 - x1))


def tensile_modulus_error(test: RopeTestRecord, error_share: float) -> float:
    """Relative error of Eq. 7 from those of two forces and two elongations, each ``error_share`` of the printed one."""
    x1, x2 = secant_elongations(test)
    force = error_share * FORCE_ERROR / ((MAX_FORCE_SHARE - MIN_FORCE_SHARE) * BREAKING_FORCE)
    elongation = error_share * ELONGATION_ERROR / (x2 - x1)
    return math.sqrt(2.0 * force**2 + 2.0 * elongation**2)


def dynamic_modulus_error(row: MaterialRow, error_share: float) -> float:
    """Relative error of |E*| from those of the amplitudes of force and elongation, ``error_share`` of the printed."""
    force = row.quantities["stress_amplitude"].value * METALLIC_AREA
    elongation = row.quantities["strain_amplitude"].value * ROPE_LENGTH
    return error_share * math.hypot(FORCE_ERROR / force, ELONGATION_ERROR / elongation)


def loop_complex_modulus(frequency: float, loop: RopeTestRecord) -> complex:
    """Complex modulus of a hysteresis loop of one period, in Pa: first harmonics of stress and strain."""
    rotation = np.exp(-2j * math.pi * frequency * loop.time[1:])
    stress = np.mean(loop.load[1:] * rotation) / METALLIC_AREA
    return complex(stress / (np.mean(loop.elongation[1:] * rotation) / ROPE_LENGTH))


def column_value(column: str, modulus: complex, frequency: float) -> float:
    """Value of a column of Table 1 for a complex modulus, in SI units."""
    return {
        "dynamic_modulus": abs(modulus),
        "storage_modulus": modulus.real,
        "phase": math.atan2(modulus.imag, modulus.real),
        "loss_factor": modulus.imag / modulus.real,
        "damping": modulus.imag / (2.0 * math.pi * frequency),
    }[column]


def secant_elongations(test: RopeTestRecord) -> tuple[float, float]:
    """Elongations at 10 % and 30 % of the breaking force while the load rises, in m.

    Beyond the last load extrapolated by its last slope.
    """
    rising_count = int(np.argmax(test.load)) + 1
    load, elongation = test.load[:rising_count], test.elongation[:rising_count]
    slope = (elongation[-1] - elongation[-2]) / (load[-1] - load[-2])
    low, high = MIN_FORCE_SHARE * BREAKING_FORCE, MAX_FORCE_SHARE * BREAKING_FORCE
    extrapolated = elongation[-1] + slope * max(high - load[-1], 0.0)
    return float(np.interp(low, load, elongation)), float(np.interp(high, load, elongation, right=extrapolated))


def _sine_program(row: MaterialRow) -> tuple[Array, Array]:
    """Sinusoidal strain of Table 1's amplitude, until the transient has decayed."""
    periods = max(3, math.ceil(TRANSIENT_DURATION * row.frequency))
    time = np.linspace(0.0, periods / row.frequency, periods * SAMPLES_PER_PERIOD + 1)
    omega = 2.0 * math.pi * row.frequency
    speed = row.quantities["strain_amplitude"].value * ROPE_LENGTH * omega * np.cos(omega * time)
    return time, speed


def _last_period(frequency: float, run: RopeTestRecord) -> RopeTestRecord:
    """The last period, load and elongation about their means."""
    last_rows = slice(-SAMPLES_PER_PERIOD - 1, None)
    elongation, load = run.elongation[last_rows], run.load[last_rows]
    return RopeTestRecord(run.time[last_rows], elongation - elongation[1:].mean(), load - load[1:].mean())
