"""FMUs that are built by the first of several test processes that needs them."""

from __future__ import annotations

import fcntl
import os
import pickle
from pathlib import Path

import pytest

from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot


def fmus_built_once(robot: Robot, name: str, factory: pytest.TempPathFactory, native: bool = False) -> RobotFmus:
    """The FMUs of a robot, in a folder of that name that all workers of a run share."""
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / f"fmus-{name}"
    folder.mkdir(exist_ok=True)
    return _built(robot, folder, native)


def _built(robot: Robot, folder: Path, native: bool) -> RobotFmus:
    done = folder / "fmus.pickle"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            done.write_bytes(pickle.dumps(build_fmus(robot, folder / "built", native=native)))
    fmus: RobotFmus = pickle.loads(done.read_bytes())
    return fmus
