"""Makes the robot and the two recordings of a case, once, as files whose names tell nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Robot
from tests.rig import make_recording
from tests.rig.lifelike.case import lifelike
from tests.support.robots import example

from .cases import Case
from .lifelike_cases import LifelikeCase
from .motion import declared, program_of
from .sizes import strengths

ROLES = ("fit", "check")


class Material(NamedTuple):
    """What a case gives to the tracer, and what the rig says of a lifelike one."""

    robot: Robot
    fit: Recording
    check: Recording
    truth: dict[str, Any]


def material(case: Case, folder: Path) -> Material:
    """Robot, FIT and CHECK of a case; files of an earlier call serve again while nothing that makes them changed."""
    if not isinstance(case, LifelikeCase):
        return Material(example(case.robot), *recordings(case, folder), {})
    place = folder / case.fingerprint({})
    if not (place / "truth.json").exists():
        made = lifelike(
            case.own_seed,
            case.hide,
            cables=case.cables,
            planar=case.planar,
            turning=case.turning,
            exact=case.exact,
        )
        made.write(place)
    robot = read_robot(place / "robot.toml")
    fit, check = (read_recording(place / f"{role}.csv", len(robot.cables)) for role in ROLES)
    return Material(robot, fit, check, json.loads((place / "truth.json").read_text(encoding="utf-8")))


def recordings(case: Case, folder: Path) -> tuple[Recording, Recording]:
    """FIT and CHECK of a case on an example robot."""
    effects = case.effects(strengths(case))
    place = folder / case.fingerprint(effects)
    place.mkdir(parents=True, exist_ok=True)
    count = declared(case.robot).count
    fit, check = (_recording(case, role, effects, place / f"{role}.parquet", count) for role in ROLES)
    return fit, check


def _recording(case: Case, role: str, effects: dict[str, object], path: Path, count: int) -> Recording:
    if not path.exists():
        motion, seed = case.motion, case.seed(role)
        frame = make_recording(
            declared(case.robot),
            effects,
            program_of(case.robot, motion, seed),
            duration=motion.duration,
            rate=motion.rate,
            seed=seed,
        )
        unfinished = path.with_suffix(".part")
        frame.to_parquet(unfinished)
        unfinished.replace(path)
    return read_recording(path, count)
