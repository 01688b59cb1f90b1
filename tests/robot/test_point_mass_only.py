"""What computes point masses only refuses rigid platforms, in one sentence, and reads no recording before it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.errors import RigidPlatformError
from tautwire.estimation.input_design import default_limits
from tautwire.recordings.recording import Recording
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import Robot
from tests.support.rigid_robots import suspended_robot

STANDING = Recording("standing", np.arange(3.0), np.zeros((3, 4)), np.full((3, 4), 100.0), np.zeros((3, 3)))


def uncertain(robot: Robot) -> Robot:
    return replace(robot, platform=replace(robot.platform, mass_uncertainty=1.0))


COMPUTATIONS: dict[str, Callable[[Robot], object]] = {
    "excitation": default_limits,
}


@pytest.mark.parametrize("name", COMPUTATIONS)
def test_a_rigid_platform_is_refused(name: str) -> None:
    with pytest.raises(RigidPlatformError, match="rigid body, which cannot be computed here yet") as caught:
        COMPUTATIONS[name](uncertain(suspended_robot(4)))
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    "command",
    (["excite", "ROBOT", "--out", "out.csv"],),
)
def test_a_command_refuses_a_rigid_platform(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_robot(suspended_robot(4), tmp_path / "hall.toml")
    assert run([part.replace("ROBOT", "hall.toml") for part in command]) == 2
    error = capsys.readouterr().err
    assert "hall.toml: the platform is a rigid body, which cannot be computed here yet" in error
    assert [path.name for path in tmp_path.iterdir()] == ["hall.toml"]
