"""Isolated runs: errors and rows of FMUs that hang or crash, and results equal to those of other runs."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.control import ClosedLoopOptions, cosimulate_closed_loop, design_controller
from tautwire.cosimulation import (
    CallAbortedError,
    ComponentError,
    Experiment,
    FixedStep,
    MemoryRecorder,
    PiecewiseLinearInput,
    Port,
    RunAbortedError,
    RunStatistics,
    simulate_isolated,
)
from tautwire.cosimulation import isolation as watch
from tautwire.cosimulation.robot_cosimulation import CosimulationResult, RunError, cosimulate
from tautwire.fmus.packaging import RobotFmus
from tautwire.robot.trajectory import PAPER_HELIX
from tests.support.faults import FAULT, NUMBERS, build_faulty, coupled
from tests.support.robots import paper_robot

TIMES = np.linspace(0.0, 0.2, 11)
SHOWN = [Port("left", "winch_speed"), Port("right", "winch_speed")]
SHORT = 1.0
HUNG = "did not return for 1 s"
SEGV, ABORT = "ended its process by SIGSEGV", "ended its process by SIGABRT"
LEFT = "ended its process with exit status 3"


@pytest.fixture(scope="session")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU with faults, built once."""
    return build_faulty(tmp_path_factory.mktemp("faulty"))


@pytest.fixture
def numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the FMU writes the number of each process that holds it; all temporary files go beside."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    monkeypatch.setenv(NUMBERS, str(tmp_path / "numbers"))
    return tmp_path / "numbers"


def nothing_is_left(numbers: Path) -> bool:
    """No process that held an FMU lives, and no temporary file is there."""
    known = {int(line) for line in numbers.read_text().split()} - {os.getpid()}
    alive = [number for number in known if is_alive(number)]
    return bool(known) and not alive and not list((numbers.parent / "scratch").iterdir())


def is_alive(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    # A process that has ended stays in the table until its parent asks; an orphan's new parent may be slow.
    return "\nState:\tZ" not in Path(f"/proc/{number}/status").read_text()


def run(
    fmu: Path, source: Any = None, patience: float = 60.0, recorder: MemoryRecorder | None = None
) -> tuple[RunStatistics, MemoryRecorder]:
    """A run of two coupled winches, asked for 2 m/s^2."""
    kept = MemoryRecorder(len(TIMES), 2) if recorder is None else recorder
    ramp = PiecewiseLinearInput(TIMES, 2.0 * TIMES[:, None])
    statistics = simulate_isolated(
        partial(coupled, fmu), Experiment(source or ramp, TIMES, FixedStep(0.01)), SHOWN, kept, call_timeout=patience
    )
    return statistics, kept


def test_a_run_without_faults_is_whole_and_leaves_nothing(faulty: Path, numbers: Path) -> None:
    statistics, kept = run(faulty)
    assert statistics.steps == 20
    assert kept.count == len(TIMES)
    assert kept.rows == pytest.approx(np.column_stack([2.0 * TIMES, 2.0 * TIMES]))
    assert nothing_is_left(numbers)


@pytest.mark.validate(only=["did not return for 1 s"])
@pytest.mark.parametrize(
    ("how", "fate"), [("hang", HUNG), ("spin", HUNG), ("crash", SEGV), ("abort", ABORT), ("leave", LEFT)]
)
def test_an_fmu_lost_in_a_step_is_named_and_what_came_before_is_kept(
    faulty: Path, numbers: Path, monkeypatch: pytest.MonkeyPatch, how: str, fate: str
) -> None:
    monkeypatch.setenv(FAULT, f"right:step:{how}:0.09")
    kept = MemoryRecorder(len(TIMES), 2)
    with pytest.raises(CallAbortedError) as caught:
        run(faulty, recorder=kept, patience=SHORT if fate == HUNG else 60.0)
    error = caught.value
    assert (error.component, error.call, error.status) == ("right", "fmi2DoStep", fate)
    assert error.time == pytest.approx(0.09)
    # The mean of what it is asked for at both ends of the step.
    assert error.inputs == {"speed_command": pytest.approx(0.19)}
    assert error.messages == ("it may get worse",)
    assert str(error) == f"FMU right: fmi2DoStep {fate} at 0.09 s with speed_command=0.19; it logged: it may get worse"
    assert kept.rows[:, 0] == pytest.approx(2.0 * TIMES[:5])
    assert nothing_is_left(numbers)


@pytest.mark.validate(but=["crash"])
@pytest.mark.parametrize(
    ("where", "call"),
    [
        ("instantiate", "fmi2Instantiate"),
        ("setup", "fmi2SetupExperiment"),
        ("enter", "fmi2EnterInitializationMode"),
        ("exit", "fmi2ExitInitializationMode"),
    ],
)
@pytest.mark.parametrize(("how", "fate"), [("hang", HUNG), ("crash", SEGV)])
def test_an_fmu_lost_before_the_first_step_is_named(
    faulty: Path, numbers: Path, monkeypatch: pytest.MonkeyPatch, where: str, call: str, how: str, fate: str
) -> None:
    monkeypatch.setenv(FAULT, f"left:{where}:{how}:0")
    with pytest.raises(CallAbortedError) as caught:
        run(faulty, patience=SHORT if fate == HUNG else 60.0)
    assert (caught.value.component, caught.value.call, caught.value.status) == ("left", call, fate)
    assert caught.value.inputs == ({"speed_command": 0.0, "speed_command_rate": 2.0} if where == "exit" else {})
    assert nothing_is_left(numbers)


@pytest.mark.validate
def test_what_a_hanging_fmu_has_started_ends_with_it(
    faulty: Path, numbers: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FAULT, "left:step:hang_beside_a_tool:0.05")
    with pytest.raises(CallAbortedError):
        run(faulty, patience=SHORT)
    assert len(set(numbers.read_text().split())) == 2
    time.sleep(0.2)
    assert nothing_is_left(numbers)


class Failing:
    """Drives nothing from some time on."""

    def __init__(self, begin: float, fault: BaseException | None) -> None:
        self.begin = begin
        self.fault = fault

    def interval(self, index: int, at: float, step: float, shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if at >= self.begin:
            if self.fault is None:
                time.sleep(3600)
            else:
                raise self.fault
        return np.array([2.0, 0.0]), np.array([2.0, 0.0])


@pytest.mark.validate
def test_a_source_that_hangs_is_not_taken_for_an_fmu(faulty: Path, numbers: Path) -> None:
    with pytest.raises(RunAbortedError, match=r"the run did not return for 1 s outside any FMU at 0\.1 s"):
        run(faulty, Failing(0.1, None), SHORT)
    assert nothing_is_left(numbers)


def test_errors_of_the_run_arrive_as_they_were_raised(faulty: Path, numbers: Path) -> None:
    with pytest.raises(KeyError, match="speed") as caught:
        run(faulty, Failing(0.1, KeyError("speed")))
    assert "in interval" in str(caught.value.__cause__)
    with pytest.raises(ComponentError) as failed:
        run(faulty, Failing(0.1, ComponentError("left", "fmi2DoStep", "error", 0.1, {"speed_command": 0.2}, ["said"])))
    assert failed.value.inputs == {"speed_command": 0.2}
    assert str(failed.value) == "FMU left: fmi2DoStep gave 'error' at 0.1 s with speed_command=0.2; it logged: said"
    assert nothing_is_left(numbers)


def test_what_fails_in_the_parent_process_ends_the_isolated_run(faulty: Path, numbers: Path) -> None:
    class Full(MemoryRecorder):
        def add(self, time: float, row: np.ndarray) -> None:
            raise OSError("no space left")

    with pytest.raises(OSError, match="no space left"):
        run(faulty, recorder=Full(1, 2))
    assert nothing_is_left(numbers)


def same(motion: CosimulationResult, other: CosimulationResult) -> bool:
    """Whether two runs are the same, to the last bit."""
    return all(
        np.array_equal(getattr(motion, name), getattr(other, name))
        for name in ("time", "position", "velocity", "tension", "length", "elongation", "strain")
    )


@pytest.mark.validate(but=["None"])
@pytest.mark.parametrize("tolerance", [None, 1e-6])
def test_an_isolated_run_is_the_same_to_the_last_bit(three_fmus: RobotFmus, tolerance: float | None) -> None:
    times = np.linspace(0.0, 2.0, 41)
    speeds = np.sin(times)[:, None] * np.array([0.3, 0.25, -0.25])
    fractions: list[float] = []
    here = cosimulate(three_fmus, times, speeds, tolerance=tolerance)
    apart = cosimulate(three_fmus, times, speeds, tolerance=tolerance, progress=fractions.append, patience=60.0)
    assert same(here, apart)
    assert here.statistics == apart.statistics
    assert fractions == pytest.approx(np.arange(1, 41) / 40)


@pytest.mark.validate
def test_so_is_a_run_with_a_controller(damped_fmus: RobotFmus) -> None:
    robot = paper_robot(damping=2.08e9)
    controller = design_controller(robot)
    here, apart = (
        cosimulate_closed_loop(
            damped_fmus, robot, controller, PAPER_HELIX, 0.2, ClosedLoopOptions(seed=3, patience=patience)
        )
        for patience in (None, 60.0)
    )
    assert len(here.time) > 5
    assert same(here, apart)


def test_a_failing_robot_keeps_its_run(three_fmus: RobotFmus) -> None:
    times, speeds = np.array([0.0, 0.1, 0.2, 0.3]), np.zeros((4, 3))
    speeds[3, 1] = 1e300
    failures = []
    for patience in (None, 60.0):
        with pytest.raises(RunError) as caught:
            cosimulate(three_fmus, times, speeds, patience=patience)
        failures.append(caught.value)
    here, apart = failures
    assert str(here) == str(apart)
    assert here.cause.inputs.keys() == apart.cause.inputs.keys()
    assert same(here.result, apart.result)


@pytest.mark.validate
def test_a_fresh_process_does_as_well_as_a_fork(faulty: Path, numbers: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "start_method", lambda: "spawn")
    statistics, kept = run(faulty)
    assert (statistics.steps, kept.count) == (20, len(TIMES))
    monkeypatch.setenv(FAULT, "right:step:crash:0.09")
    with pytest.raises(CallAbortedError, match="FMU right: fmi2DoStep ended its process by SIGSEGV"):
        run(faulty)
    assert nothing_is_left(numbers)


SCRIPT = """
import sys
from pathlib import Path
from tests.cosimulation.test_isolation import run
print("begun", flush=True)
run(Path(sys.argv[1]), patience=600.0)
"""


@pytest.mark.validate
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL])
def test_ending_the_parent_process_ends_the_isolated_run(
    faulty: Path, numbers: Path, monkeypatch: pytest.MonkeyPatch, ending: signal.Signals
) -> None:
    # Killed outright, nobody but the watched process can clean up; it needs its interpreter for that.
    monkeypatch.setenv(FAULT, f"right:step:{'hang' if ending == signal.SIGINT else 'spin'}:0.09")
    monkeypatch.setenv("TMPDIR", tempfile.gettempdir())
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(faulty)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    begun = time.monotonic()
    while not numbers.exists() and time.monotonic() - begun < 30.0:
        time.sleep(0.05)
    time.sleep(0.5)
    process.send_signal(ending)
    _, stderr = process.communicate(timeout=20)
    assert process.returncode == -ending
    assert ("KeyboardInterrupt" in stderr) == (ending == signal.SIGINT)
    while not nothing_is_left(numbers) and time.monotonic() - begun < 40.0:
        time.sleep(0.05)
    assert nothing_is_left(numbers)
    assert multiprocessing.active_children() == []
