"""Runs a tensile test on one cable FMU: the rope between fixed grips is reeled in, its tension is the load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ..fmus.packaging import build_fmus
from ..master import Component
from ..master.seat import INPUT_TIME
from ..materials import RobotMaterial, with_material
from ..robots.robot import Cable, Platform, Robot, Sensors

Array = NDArray[np.float64]

GRAVITY = 9.81
# rad, inclination of the three ropes from the vertical, so that statics gives each the same tension.
ROPE_INCLINATION = math.pi / 4.0


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
    increments = 0.5 * np.diff(time) * (speed[1:] + speed[:-1])
    return RopeTestRecord(time, np.append(0.0, np.cumsum(increments)), load)
