"""What ``import tautwire`` gives: each name with its module when it is asked for, typed and described."""

import ast
import inspect
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import tautwire
from tautwire.errors import RecordingError
from tautwire.fmus.packaging import RobotFmus
from tests.support.robots import EXAMPLES, example

THREE = EXAMPLES / "three"
SLOW = ("casadi", "control", "pandas", "fmpy", "scipy", "numpy", "matplotlib")


def test_every_name_is_there_and_described() -> None:
    for name in tautwire.__all__:
        result = getattr(tautwire, name)
        assert inspect.getdoc(result), name
        assert name in dir(tautwire)
    assert set(tautwire.__all__) == set(tautwire._MODULES)
    with pytest.raises(AttributeError, match="flies"):
        tautwire.flies  # noqa: B018


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse(Path(str(tautwire.__file__)).read_text(encoding="utf-8"))
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    imported = {
        alias.name: f".{node.module}" for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    assert imported == tautwire._MODULES
    assert Path(str(tautwire.__file__)).with_name("py.typed").exists()


@pytest.mark.validate
def test_a_type_checker_refuses_names_that_are_not_ours(tmp_path: Path) -> None:
    (tmp_path / "user.py").write_text("from tautwire import tracee\n", encoding="utf-8")
    root = Path(str(tautwire.__file__)).parents[1]
    paths = f"{root}{os.pathsep}{root.parent / 'fmu_src'}"
    call = [sys.executable, "-m", "mypy", "--config-file", os.devnull, "--follow-imports", "silent", "user.py"]
    environment = {**os.environ, "MYPYPATH": paths}
    completed = subprocess.run(call, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment).stdout
    assert 'Module "tautwire" has no attribute "tracee"' in completed


def test_the_package_and_its_command_line_import_nothing_slow() -> None:
    code = f"import sys, tautwire.cli.application; print([name for name in {SLOW!r} if name in sys.modules])"
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert completed.strip() == "[]"


def test_docstrings_name_what_is_raised() -> None:
    for name in tautwire.__all__:
        assert "Raises " in str(inspect.getdoc(getattr(tautwire, name))), name


def test_recordings_go_from_frames_to_frames() -> None:
    frame = pd.read_csv(THREE / "fit.csv").iloc[:50]
    recording = tautwire.recording_from_frame(frame, 3)
    read = tautwire.read_recording(THREE / "fit.csv", 3).first(50)
    assert np.array_equal(recording.measured(), read.measured())
    pd.testing.assert_frame_equal(recording.frame()[list(frame.columns)], frame, check_dtype=False)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda frame: frame.assign(x="far"), "column x"),
        (lambda frame: frame.drop(columns="time"), "time is missing"),
        (lambda frame: frame.assign(time=0.0), "row 2, column time"),
        (lambda frame: frame.assign(winch_speed_1=np.nan), "row 1, column winch_speed_1"),
        (lambda frame: frame.set_axis(["time"] * len(frame.columns), axis="columns"), "appears twice"),
    ],
)
def test_a_frame_that_is_no_recording_is_refused(change, said: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RecordingError, match=said):
        tautwire.recording_from_frame(change(pd.read_csv(THREE / "fit.csv").iloc[:5]), 3)


def test_columns_of_a_frame_drive_a_run(three_fmus: RobotFmus) -> None:
    frame = tautwire.read_recording(THREE / "fit.csv", 3).first(20).frame()
    motion = tautwire.cosimulate(three_fmus, frame["time"], frame[[f"winch_speed_{i}" for i in (1, 2, 3)]])
    assert motion.frame()["time"].tolist() == frame["time"].tolist()


def test_figures_are_returned_and_not_shown() -> None:
    plant = tautwire.linearise(example("three"))
    assert isinstance(tautwire.bode_figure(plant.system, "winch_speed_1", "position_x"), Figure)
    path = tautwire.Line((28.86, 0.0, 5.0), (28.86, 0.0, 6.0), 1.0)
    assert isinstance(tautwire.modes_along_figure(tautwire.modes_along(example("three"), path, points=3)), Figure)
    shown = sys.modules.get("matplotlib.pyplot")
    assert shown is None or not shown.get_fignums()
