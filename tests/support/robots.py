"""Robots that several tests use."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np

from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Cable, Platform, Robot, Sensors, Winch

EXAMPLES = Path(str(files("tautwire"))) / "examples"
NAMES = ("three", "caroca", "eight")
LIMITED = Winch(drum_radius=0.2, gear=15.0, bandwidth=8.0, damping_ratio=0.7, speed_limit=0.9, acceleration_limit=1.5)


def example(name: str) -> Robot:
    """A robot that ships with the project."""
    return read_robot(EXAMPLES / name / "robot.toml")


def paper_robot(damping: float = 0.0, law: str = "logarithmic", modulus: float = 134.8e9) -> Robot:
    """The paper's three-cable robot with the disc area, as its figures were made."""
    anchors = ((0.0, 50.0, 50.0), (0.0, -50.0, 50.0), (86.6, 0.0, 50.0))
    area = float(np.pi * 0.002**2)
    cables = tuple(Cable(anchor, modulus, area, damping, law) for anchor in anchors)
    return Robot("paper", 9.8, Platform(300.0, (28.86, 0.0, 5.0)), None, Sensors(), cables)


def with_damping(robot: Robot, damping: float) -> Robot:
    """The robot with another declared damping."""
    return replace(robot, cables=tuple(replace(cable, damping=damping) for cable in robot.cables))


def with_winch(robot: Robot, winch: Winch) -> Robot:
    """The robot on winches that follow their commands."""
    return replace(robot, winch=winch)


def gentle_speeds(robot: Robot, duration: float, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (N,) and smooth winch speeds (N, n) from rest that keep the platform near its start."""
    time = np.arange(0.0, duration + interval / 2, interval)
    reach = 0.003 * float(np.min([np.linalg.norm(np.array(a) - robot.platform.start) for a in robot.anchors]))
    rise = 1.0 - np.exp(-((time / 1.5) ** 3))
    path = np.stack([np.sin(2.1 * time), np.sin(1.3 * time), 1.0 - np.cos(1.7 * time)], axis=1) * rise[:, None]
    position = np.array(robot.platform.start) + reach * path
    length = np.linalg.norm(np.array(robot.anchors)[None] - position[:, None], axis=2)
    return time, -np.gradient(length, time, axis=0)
