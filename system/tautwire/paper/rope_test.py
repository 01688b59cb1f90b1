"""A tensile machine around one cable FMU: the rope between fixed grips is reeled in, its tension is the load."""

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
from ..master.seat import STAMP
from ..materials import RobotMaterial, with_material
from ..robots.robot import Cable, Platform, Robot, Sensors

Array = NDArray[np.float64]

GRAVITY = 9.81
# Of the three ropes from the vertical, so that statics gives each the same tension.
LEAN = math.pi / 4.0


@dataclass(frozen=True)
class RopeTest:
    """A rope of ``area`` (m^2) and ``length`` (m) between grips, under ``preload`` (N) at the start."""

    area: float
    length: float
    preload: float


@dataclass(frozen=True)
class Pulled:
    """What a test gives: ``elongation`` (N,) in m of the grips since the start, and ``load`` (N,) in N."""

    time: Array
    elongation: Array
    load: Array


def pull(test: RopeTest, rope: RobotMaterial, programs: Sequence[tuple[Array, Array]]) -> list[Pulled]:
    """Run programs of ``(time, speed of the grip)``, in s and m/s, each from the start, on one cable FMU.

    Speeds are linear between samples. Raises ComponentError where the FMU fails.
    """
    with TemporaryDirectory(prefix="tautwire-rope-") as folder:
        fmu = build_fmus(_machine(test, rope), Path(folder)).cables[0]
        return [_run(fmu, test, time, speed) for time, speed in programs]


def _machine(test: RopeTest, rope: RobotMaterial) -> Robot:
    """A robot each of whose three ropes is as long as the tested one and as tight."""
    angles = 2.0 * math.pi / 3.0 * np.arange(3)
    out, up = test.length * math.sin(LEAN), test.length * math.cos(LEAN)
    cables = tuple(
        Cable((out * math.cos(a), out * math.sin(a), up), rope.modulus, test.area, rope.damping, "logarithmic")
        for a in angles.tolist()
    )
    mass = 3.0 * test.preload * math.cos(LEAN) / GRAVITY
    plain = Robot("tensile machine", GRAVITY, Platform(mass, (0.0, 0.0, 0.0)), None, Sensors(), cables)
    return with_material(plain, rope)


def _run(fmu: Path, test: RopeTest, time: Array, speed: Array) -> Pulled:
    rates = np.append(np.diff(speed) / np.diff(time), 0.0)
    load = np.empty(len(time))
    with Component("rope", fmu) as component:
        inputs = component.block((STAMP, "winch_speed", "winch_acceleration"))
        output = component.block(("tension",))
        component.initialize(float(time[0]), {})
        component.run()
        for row in range(len(time)):
            if row:
                inputs.values[:] = time[row], speed[row], rates[row - 1]
                component.write(inputs)
                component.step(float(time[row - 1]), float(time[row] - time[row - 1]))
            inputs.values[:] = time[row], speed[row], rates[row]
            component.write(inputs)
            component.read(output)
            load[row] = output.values[0]
    slices = 0.5 * np.diff(time) * (speed[1:] + speed[:-1])
    return Pulled(time, np.append(0.0, np.cumsum(slices)), load)
