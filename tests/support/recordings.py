"""Recordings that the rig makes, as the tracer takes them."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np

from tautwire.recordings.recording import Recording
from tautwire.robot.schema import AXES
from tests.rig import SampledProgram, load_robot, make_recording, wander
from tests.rig.record import KINKED
from tests.support.robots import EXAMPLES

REACH = {"three": 5.0, "caroca": 0.5, "eight": 0.8}
DURATION = {"three": 16.0, "caroca": 4.0, "eight": 5.0}
RATE = {"three": 50.0, "caroca": 200.0, "eight": 100.0}


def recorded(
    robot: str, seed: int, effects: dict[str, Any] | None = None, gap: tuple[float, float] = (0.0, 0.0)
) -> Recording:
    """A short recording of an example robot that does what ``effects`` say; the same for the same arguments.

    No samples come between the ends of the gap (s).
    """
    return _recorded(robot, seed, json.dumps(effects or {}), gap)


@cache
def _recorded(robot: str, seed: int, effects: str, gap: tuple[float, float]) -> Recording:
    declared = load_robot(EXAMPLES / robot / "robot.toml")
    smooth = wander(declared, seed, REACH[robot], slow=(5.0, 12.0), shake=0.6)
    times = np.arange(round(DURATION[robot] * RATE[robot]) + 1) / RATE[robot]
    times = times[(times <= gap[0]) | (times >= gap[1])]
    # Winch speeds of a recording are linear between samples, by its format.
    program = SampledProgram(times, np.array([smooth.speed(float(time)) for time in times]))
    # Errors of 2e-4 N and 12 nm are far below noise.
    frame = make_recording(
        declared,
        json.loads(effects),
        program,
        duration=DURATION[robot],
        rate=RATE[robot],
        seed=seed,
        accuracy=KINKED,
    )
    frame = frame[(frame["time"] <= gap[0]) | (frame["time"] >= gap[1])]
    count = declared.count

    def columns(names: list[str]) -> np.ndarray:
        return frame[names].to_numpy(dtype=float)

    return Recording(
        path=f"{robot}-{seed}.csv",
        time=frame["time"].to_numpy(dtype=float),
        winch_speed=columns([f"winch_speed_{i + 1}" for i in range(count)]),
        tension=columns([f"tension_{i + 1}" for i in range(count)]),
        position=columns(list(AXES)),
    )
