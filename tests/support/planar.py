"""A planar robot on four cables whose positions alone were measured: files as its owner would have them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.rig import PathProgram, Robot, SampledProgram, load_robot, make_recording, write_recording

ANCHORS = ((0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0))
RATE = 100.0


@dataclass(frozen=True)
class Plane:
    """Where the two axes of a planar robot lie: ``up`` names the second, ``gravity`` is in m/s^2."""

    up: str
    gravity: float

    @property
    def axes(self) -> tuple[str, str]:
        """The measured columns."""
        return ("x", self.up)

    def point(self, x: float, second: float) -> list[float]:
        """A place in the plane."""
        return [x, second, 0.0] if self.up == "y" else [x, 0.0, second]

    @property
    def mask(self) -> np.ndarray:
        """One along the plane, zero across it."""
        return np.array(self.point(1.0, 1.0))


VERTICAL = Plane("z", 9.81)
HORIZONTAL = Plane("y", 0.0)


def robot_text(plane: Plane, preferred: float = 80.0, beside: str = "") -> str:
    """The robot file; ``beside`` goes into its table [tension]."""
    cables = "".join(
        f"[[cable]]\nanchor = {plane.point(*anchor)}\nmodulus = 1.0e10\narea = 2.0e-6\ndamping = 2.0e7\n"
        'law = "logarithmic"\n\n'
        for anchor in ANCHORS
    )
    return (
        f'name = "planar"\ngravity = {plane.gravity}\n\n[platform]\nmass = 5.0\nstart = {plane.point(1.4, 0.9)}\n\n'
        f"[tension]\nminimum = 10.0\nmaximum = 800.0\npreferred = {preferred}\n{beside}\n"
        "[sensors]\nposition_noise = 1.0e-4\nwinch_speed_noise = 1.0e-4\n\n"
        f"{cables}"
    )


def program_of(robot: Robot, plane: Plane, seed: int, duration: float, rate: float = RATE) -> SampledProgram:
    """Winch speeds that lead the platform about in its plane: slow tones, and fast ones that shake it."""
    random = np.random.default_rng(seed)
    slow, fast = 2.0 * np.pi / random.uniform(2.5, 6.0, 3), 2.0 * np.pi * random.uniform(2.0, 9.0, 4)
    angular = np.concatenate([slow, fast])
    size = np.concatenate([np.full(3, 0.18), 1.0 / fast**2])
    path = PathProgram(
        anchors=robot.anchors,
        start=robot.start,
        shift=np.array(plane.point(0.1, 0.1)),
        amplitudes=random.uniform(-1.0, 1.0, (7, 3)) * size[:, None] * plane.mask,
        angular=angular,
        phases=random.uniform(0.0, 2.0 * np.pi, (7, 3)),
        rise=2.0,
    )
    times = np.arange(round(duration * rate) + 1) / rate
    return SampledProgram(times, np.array([path.speed(float(time)) for time in times]))


def planar_recording(
    folder: Path,
    plane: Plane,
    effects: dict[str, Any],
    seed: int,
    duration: float = 12.0,
    preferred: float = 80.0,
) -> pd.DataFrame:
    """Times, winch speeds and the two coordinates; no tensions. ``preferred`` is the true start's, N."""
    true = folder / f"true-{seed}.toml"
    true.write_text(robot_text(plane, preferred))
    robot = load_robot(true)
    program = program_of(robot, plane, seed, duration)
    frame = make_recording(robot, effects, program, duration=duration, rate=RATE, seed=seed)
    return frame[["time", *(f"winch_speed_{cable}" for cable in range(1, 5)), *plane.axes]]


def planar_case(
    folder: Path, plane: Plane, effects: dict[str, Any], seed: int, preferred: float = 80.0, duration: float = 12.0
) -> list[Path]:
    """Robot file, FIT and CHECK, in the order of the command's arguments."""
    robot = folder / "robot.toml"
    robot.write_text(robot_text(plane))
    paths = [robot]
    for role, own in (("fit", seed), ("check", seed + 50)):
        path = folder / f"{role}.csv"
        write_recording(planar_recording(folder, plane, effects, own, duration, preferred), path)
        paths.append(path)
    return paths
