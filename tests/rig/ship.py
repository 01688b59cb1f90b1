"""Remakes the recordings that are shipped beside the example robots: python -m tests.rig.ship."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tests.rig.mechanics import Settings
from tests.rig.program import SampledProgram
from tests.rig.record import make_recording, write_recording
from tests.rig.robot import load_robot
from tests.rig.wander import wander

EXAMPLES = Path(__file__).resolve().parents[2] / "system" / "tautwire" / "examples"


@dataclass(frozen=True)
class Shipment:
    """How the two recordings of one example are made; `reach` and `centre` in m, `rate` in Hz."""

    name: str
    effects: Settings
    duration: float
    rate: float
    reach: float
    centre: tuple[float, float, float]
    slow: tuple[float, float]
    seeds: Mapping[str, int]


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
)


def make(shipment: Shipment, which: str) -> pd.DataFrame:
    """One of the two recordings, `fit` or `check`."""
    robot = load_robot(EXAMPLES / shipment.name / "robot.toml")
    seed = shipment.seeds[which]
    smooth = wander(robot, seed, shipment.reach, shipment.centre, shipment.slow)
    times = np.arange(round(shipment.duration * shipment.rate) + 1) / shipment.rate
    program = SampledProgram(times, np.array([smooth.speed(float(time)) for time in times]))
    return make_recording(
        robot, shipment.effects, program, duration=shipment.duration, rate=shipment.rate, seed=seed + 1000
    )


def main() -> None:
    """Write every shipped recording into its place."""
    for shipment in SHIPMENTS:
        for which in shipment.seeds:
            path = EXAMPLES / shipment.name / f"{which}.csv"
            write_recording(make(shipment, which), path)
            print(f"{shipment.name}/{which}.csv  {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
