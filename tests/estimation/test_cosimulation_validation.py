"""Validation by co-simulation: FMUs of machine code where a compiler works, which changes no result."""

import subprocess
from collections.abc import Sequence
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, run_cosimulation
from tautwire.estimation.cosimulation_validation import cosimulate_data_set
from tautwire.estimation.estimation_data import DataSet
from tautwire.fmus.native import c_toolchain
from tautwire.fmus.packaging import RobotFmus
from tautwire.robot.schema import EffectSetting
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three").with_effect(EffectSetting("damping", {"damping": 9e8}))


def motion() -> CosimulationResult:
    recording = recorded("three", 3).first(101)
    return cosimulate_data_set(ROBOT, DataSet(recording, ROBOT.platform.start, np.full(101, True)))


@pytest.fixture
def by_python(monkeypatch: pytest.MonkeyPatch) -> CosimulationResult:
    def no_toolchain() -> Any:
        raise c_toolchain.NativeBuildError("there is none", "install one")

    with monkeypatch.context() as patched:
        patched.setattr("tautwire.fmus.native.native_archive.find_toolchain", no_toolchain)
        return motion()


@pytest.mark.validate
def test_machine_code_moves_as_python_does(by_python: CosimulationResult, monkeypatch: pytest.MonkeyPatch) -> None:
    sources = []

    def watched(fmus: RobotFmus, *inputs: Any) -> CosimulationResult:
        sources.extend("sources/all.c" in ZipFile(path).namelist() for path in (fmus.platform, *fmus.cables))
        return run_cosimulation(fmus, *inputs)

    monkeypatch.setattr("tautwire.estimation.cosimulation_validation.run_cosimulation", watched)
    by_machine_code = motion()
    assert sources == [True] * 4
    assert np.max(np.abs(by_machine_code.position - by_python.position)) < 1e-9
    assert np.max(np.abs(by_machine_code.tension - by_python.tension)) < 1e-5


@pytest.mark.validate
def test_a_compiler_that_fails_leaves_python(by_python: CosimulationResult, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(command: Sequence[str], *_: Any, **__: Any) -> Any:
        return subprocess.CompletedProcess(command, 1, b"", b"error: no such header")

    monkeypatch.setattr(c_toolchain, "cached_machine_code", lambda key, compile_code: compile_code())
    monkeypatch.setattr(c_toolchain.subprocess, "run", refuses)
    assert np.array_equal(motion().tension, by_python.tension)
