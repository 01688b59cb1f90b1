"""Remakes the recordings that are shipped beside the example robots: python -m tests.rig.ship [NAME ...]."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tests.rig.mechanics import Settings
from tests.rig.pose_program import pose_wander
from tests.rig.program import SampledProgram
from tests.rig.record import make_recording, write_recording
from tests.rig.robot import Robot, load_robot
from tests.rig.wander import wander

EXAMPLES = Path(__file__).resolve().parents[2] / "system" / "tautwire" / "examples"


@dataclass(frozen=True)
class Shipment:
    """How the two recordings of one example are made; `reach` and `centre` in m, `rate` in Hz.

    A platform that turns does so by up to `tilt`, in rad, about its start.
    """

    name: str
    effects: Settings
    duration: float
    rate: float
    reach: float
    slow: tuple[float, float]
    seeds: Mapping[str, int]
    centre: tuple[float, float, float] | None = None
    tilt: float = 0.0
    shake: float = 0.2


SHIPMENTS = (
    Shipment(
        name="three",
        effects={"damping": {"damping": 2.08e9}},
        duration=40.0,
        rate=100.0,
        reach=7.0,
        centre=(28.86, 0.0, 9.0),
        slow=(12.0, 30.0),
        seeds={"fit": 11, "check": 12},
    ),
    Shipment(
        name="caroca",
        effects={"payload": {"mass": 6.4}},
        duration=20.0,
        rate=200.0,
        reach=0.6,
        centre=(0.3, -0.4, 1.2),
        slow=(6.0, 15.0),
        seeds={"fit": 21, "check": 22},
    ),
    Shipment(
        name="eight",
        effects={},
        duration=20.0,
        rate=100.0,
        reach=1.0,
        centre=(5.0, 4.0, 2.8),
        slow=(6.0, 15.0),
        seeds={"fit": 31, "check": 32},
    ),
    Shipment(
        name="cogiro",
        effects={"payload": {"mass": 5.0, "x": 0.4, "y": 0.3, "z": 0.7}},
        duration=12.0,
        rate=50.0,
        reach=0.6,
        tilt=0.12,
        slow=(4.0, 9.0),
        seeds={"fit": 41, "check": 42},
    ),
    Shipment(
        name="caroca8",
        effects={"centre_of_mass": {"x": 0.02, "y": -0.015, "z": 0.0}},
        duration=12.0,
        rate=50.0,
        reach=0.4,
        tilt=0.12,
        slow=(3.0, 7.0),
        seeds={"fit": 51, "check": 52},
    ),
    Shipment(
        name="fast",
        effects={"damping": {"damping": 9.0e8}},
        duration=30.0,
        rate=20.0,
        reach=6.0,
        tilt=0.02,
        slow=(12.0, 30.0),
        shake=0.05,
        seeds={"fit": 61, "check": 62},
    ),
    Shipment(
        name="ipanema",
        effects={},
        duration=12.0,
        rate=50.0,
        reach=0.2,
        tilt=0.08,
        slow=(3.0, 7.0),
        seeds={"fit": 71, "check": 72},
    ),
)


def planned(shipment: Shipment, robot: Robot, which: str) -> SampledProgram:
    """The winch speeds of one of the two recordings, `fit` or `check`: linear between samples."""
    seed, slow, shake = shipment.seeds[which], shipment.slow, shipment.shake
    smooth = (
        wander(robot, seed, shipment.reach, shipment.centre, slow, shake)
        if robot.body is None
        else pose_wander(robot, seed, shipment.reach, shipment.tilt, slow, shake)
    )
    times = np.arange(round(shipment.duration * shipment.rate) + 1) / shipment.rate
    return SampledProgram(times, np.array([smooth.speed(float(time)) for time in times]))


def make(shipment: Shipment, which: str, noise: bool = True) -> pd.DataFrame:
    """One of the two recordings, `fit` or `check`."""
    robot = load_robot(EXAMPLES / shipment.name / "robot.toml")
    return make_recording(
        robot,
        shipment.effects,
        planned(shipment, robot, which),
        duration=shipment.duration,
        rate=shipment.rate,
        seed=shipment.seeds[which] + 1000,
        noise=noise,
    )


def main() -> None:
    """Write the shipped recordings of the named examples into their places; of all without a name."""
    names = sys.argv[1:] or [shipment.name for shipment in SHIPMENTS]
    for shipment in (each for each in SHIPMENTS if each.name in names):
        for which in shipment.seeds:
            path = EXAMPLES / shipment.name / f"{which}.csv"
            write_recording(make(shipment, which), path)
            print(f"{shipment.name}/{which}.csv  {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
