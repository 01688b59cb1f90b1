"""Validation by co-simulation: FMUs of machine code where a compiler works, which changes no result."""

import subprocess
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast
from zipfile import ZipFile

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, run_cosimulation
from tautwire.estimation.cosimulation_validation import cosimulate_data_set, largest_chance_errors, noise_floor
from tautwire.estimation.estimation_data import DataSet
from tautwire.estimation.policy import DEFAULT_POLICY
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


def test_errors_of_noise_and_of_one_random_walk_are_within_chance_in_98_of_100_recordings() -> None:
    """Its tensions hang on one walk, which over a run is 1.5 times as large as expected in a tenth of them."""
    recording = recorded("three", 3)
    count = recording.sample_count
    data = DataSet(recording, ROBOT.platform.start, np.full(count, True))
    white, walk = 0.2, 1.0
    variances = np.tile(white**2 + walk**2 * np.linspace(0.0, 1.0, count)[:, None], (1, 6))
    noise = SimpleNamespace(white_variances=lambda cable_count: np.full(3 + cable_count, white**2))
    fitter = cast("Any", SimpleNamespace(noise=noise, open_loop_variances=lambda robot, data: variances))
    limits = largest_chance_errors(fitter, ROBOT, data, DEFAULT_POLICY.cosimulation)
    floor = noise_floor(fitter, ROBOT, data)
    random = np.random.default_rng(1)
    within, near = 0, 0
    for _ in range(400):
        drift = walk * np.cumsum(random.standard_normal(count)) / count**0.5
        errors = drift[:, None] + white * random.standard_normal((count, 3))
        tension_rms = float(np.sqrt(np.mean(errors**2)))
        within += tension_rms <= limits.tension_rms
        near += tension_rms <= 1.5 * floor.tension_rms
    assert within >= 392
    assert near < 380


def test_white_noise_alone_is_half_again_as_large_at_most() -> None:
    recording = recorded("three", 3).first(100)
    data = DataSet(recording, ROBOT.platform.start, np.full(100, True))
    noise = SimpleNamespace(white_variances=lambda cable_count: np.full(3 + cable_count, 4.0))
    fitter = cast("Any", SimpleNamespace(noise=noise, open_loop_variances=lambda robot, data: np.full((100, 6), 4.0)))
    limits = largest_chance_errors(fitter, ROBOT, data, DEFAULT_POLICY.cosimulation)
    assert (limits.position_rms, limits.tension_rms) == pytest.approx((3.0, 3.0))


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
