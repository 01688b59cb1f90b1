"""Section 3: the tensile test of Fig. 3, the dynamic tests of Fig. 4, and Table 1 from its own columns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..materials import PAPER_TABLE, RobotMaterial, read_material_table, robot_material
from ..materials.observations import observations
from ..materials.selection import best_linear
from ..materials.table import MaterialRow, MaterialTable
from .rope_test import Pulled, RopeTest, pull
from .values import Values

Array = NDArray[np.float64]

# Sec. 3.1 and 3.2.
BREAKING_FORCE = 10.29e3  # N
DIAMETER = 4e-3  # m
LENGTH = 0.35  # m, free between the grips
METALLIC_AREA = 7.1675e-6  # m^2, Ac
DISC_AREA = math.pi * (0.5 * DIAMETER) ** 2  # m^2, Sc
SPEED = 0.05e-3  # m/s
FORCE_ERROR, ELONGATION_ERROR = 1.0, 0.03e-3  # N, m
LEAST, MOST = 0.1, 0.3  # shares of the breaking force, Eq. 7
PRELOAD = 1500.0  # N

# So far the rope is tight at the start of the tensile test, in N.
TIGHT = 1.0
PER_PERIOD, LONGEST_MEMORY = 48, 10.0


@dataclass(frozen=True)
class MaterialRuns:
    """Section 3 as one set of parameters gives it: ``tensile`` up and down again, ``loops`` by frequency in Hz."""

    table: MaterialTable
    rope: RobotMaterial
    tensile: Pulled
    loops: Mapping[float, Pulled]


def printed_rope() -> RobotMaterial:
    """The rope as simulated in section 4.1: the quasi-static modulus, and nothing else."""
    table = read_material_table(PAPER_TABLE)
    return RobotMaterial(table.static[0].quantities["storage_modulus"].value, 0.0, ())


def relaxing_rope() -> RobotMaterial:
    """The rope that fits all rows of Table 1 and the static test best of those that a robot file can hold."""
    table = read_material_table(PAPER_TABLE)
    seen = observations(table, table.pairs()[0], 0.0, 1.0).with_static(table)
    return robot_material(best_linear(seen).material)


def run_material(rope: RobotMaterial) -> MaterialRuns:
    """Both tests of section 3 on one rope."""
    table = read_material_table(PAPER_TABLE)
    duration = LENGTH * MOST * BREAKING_FORCE / (METALLIC_AREA * rope.modulus) / SPEED
    time = np.linspace(0.0, 2.0 * duration, 401)
    up_and_down = np.where(time < duration, SPEED, -SPEED)
    (tensile,) = pull(RopeTest(METALLIC_AREA, LENGTH, TIGHT), rope, [(time, up_and_down)])
    programs = [_sine(row) for row in table.rows]
    pulled = pull(RopeTest(METALLIC_AREA, LENGTH, PRELOAD), rope, programs)
    loops = {row.frequency: _last_period(row.frequency, run) for row, run in zip(table.rows, pulled, strict=True)}
    return MaterialRuns(table, rope, tensile, loops)


def quantities(runs: MaterialRuns, error_share: float) -> Values:
    """What section 3 says in numbers, Table 1 apart; ``error_share`` as in :class:`Parameters`."""
    modulus = eq_7(runs.tensile, METALLIC_AREA)
    relative = eq_7_error(runs.tensile, error_share)
    sizes = {row.frequency: row.quantities for row in runs.table.rows}
    stiffness = [sizes[f]["dynamic_modulus"].value for f in sizes if f >= 1.0]
    storage = {f: row["dynamic_modulus"].value * math.cos(row["phase"].value) for f, row in sizes.items()}
    return {
        "material.test_force": MOST * BREAKING_FORCE,
        "material.length_over_diameter": LENGTH / DIAMETER,
        "material.modulus": 1e-9 * modulus,
        "material.modulus_disc": 1e-9 * eq_7(runs.tensile, DISC_AREA),
        "material.modulus_error": 1e-9 * modulus * relative,
        "material.modulus_disc_error": 1e-9 * eq_7(runs.tensile, DISC_AREA) * relative,
        "material.rise": 1e-9 * (storage[1.0] - storage[0.1]),
        "material.constant_above": 1e-9 * (max(stiffness) - min(stiffness)),
        "material.load_amplitude": sizes[0.1]["stress_amplitude"].value * METALLIC_AREA,
    }


def eq_7(test: Pulled, area: float) -> float:
    """``E = l_c (F30 - F10) / (A (x2 - x1))`` on the loading path, in Pa; Eq. 7."""
    low, high = LEAST * BREAKING_FORCE, MOST * BREAKING_FORCE
    x1, x2 = eq_7_elongations(test)
    return LENGTH * (high - low) / (area * (x2 - x1))


def eq_7_error(test: Pulled, share: float) -> float:
    """Relative error of Eq. 7 by those of two forces and two elongations, each ``share`` of what is printed."""
    x1, x2 = eq_7_elongations(test)
    force = share * FORCE_ERROR / ((MOST - LEAST) * BREAKING_FORCE)
    elongation = share * ELONGATION_ERROR / (x2 - x1)
    return math.sqrt(2.0 * force**2 + 2.0 * elongation**2)


def amplitude_error(row: MaterialRow, share: float) -> float:
    """Relative error of |E*| by those of the amplitudes of force and elongation, each ``share`` of what is printed."""
    force = row.quantities["stress_amplitude"].value * METALLIC_AREA
    elongation = row.quantities["strain_amplitude"].value * LENGTH
    return share * math.hypot(FORCE_ERROR / force, ELONGATION_ERROR / elongation)


def loop_modulus(frequency: float, loop: Pulled) -> complex:
    """The complex modulus of a loop of one period, in Pa: first harmonics of stress and strain."""
    turn = np.exp(-2j * math.pi * frequency * loop.time[1:])
    stress = np.mean(loop.load[1:] * turn) / METALLIC_AREA
    return complex(stress / (np.mean(loop.elongation[1:] * turn) / LENGTH))


def loop_value(column: str, modulus: complex, frequency: float) -> float:
    """What a complex modulus says in a column of Table 1, in SI units."""
    return {
        "dynamic_modulus": abs(modulus),
        "storage_modulus": modulus.real,
        "phase": math.atan2(modulus.imag, modulus.real),
        "loss_factor": modulus.imag / modulus.real,
        "damping": modulus.imag / (2.0 * math.pi * frequency),
    }[column]


def eq_7_elongations(test: Pulled) -> tuple[float, float]:
    """Elongations at 10 % and 30 % of the breaking force while the load rises, in m.

    Beyond the last load by its last slope.
    """
    top = int(np.argmax(test.load)) + 1
    load, elongation = test.load[:top], test.elongation[:top]
    slope = (elongation[-1] - elongation[-2]) / (load[-1] - load[-2])
    low, high = LEAST * BREAKING_FORCE, MOST * BREAKING_FORCE
    beyond = elongation[-1] + slope * max(high - load[-1], 0.0)
    return float(np.interp(low, load, elongation)), float(np.interp(high, load, elongation, right=beyond))


def _sine(row: MaterialRow) -> tuple[Array, Array]:
    """A strain of Table 1's amplitude, until what began it has died away."""
    periods = max(3, math.ceil(LONGEST_MEMORY * row.frequency))
    time = np.linspace(0.0, periods / row.frequency, periods * PER_PERIOD + 1)
    omega = 2.0 * math.pi * row.frequency
    speed = row.quantities["strain_amplitude"].value * LENGTH * omega * np.cos(omega * time)
    return time, speed


def _last_period(frequency: float, run: Pulled) -> Pulled:
    """The last period, load and elongation about their means."""
    kept = slice(-PER_PERIOD - 1, None)
    elongation, load = run.elongation[kept], run.load[kept]
    return Pulled(run.time[kept], elongation - elongation[1:].mean(), load - load[1:].mean())
