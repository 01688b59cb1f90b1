"""From a laboratory's folder to a verdict: encoder counts in a .mat file, a tracker's CSV file with its own clock."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from tautwire.cli import run
from tautwire.recordings.recording import read_recording
from tests.support.robots import EXAMPLES
from tests.support.trackers import split

THREE = EXAMPLES / "three"
LENGTH_PER_COUNT = 2.5e-5  # m
CLOCK_OFFSET = 23.0  # s


def write_folder(folder: Path) -> None:
    """The recordings of a robot that lacks damping, as two devices write them."""
    for name in ("fit", "check"):
        log, tracker = split(read_recording(THREE / f"{name}.csv", 3), 120.0, CLOCK_OFFSET, 1.0)
        counts = np.array([52000.0, 48000.0, 61000.0]) - np.round(log.wound_lengths() / LENGTH_PER_COUNT)
        drives = {f"drive{cable}_counts": counts[:, cable - 1] for cable in (1, 2, 3)}
        cells = {f"load_cell_{cable}": log.tension[:, cable - 1] for cable in (1, 2, 3)}
        savemat(folder / f"{name}.mat", {"Zeit": log.time, **drives, **cells})
        rows = np.column_stack([tracker.time, 1e3 * tracker.position])
        lines = [";".join(f"{number:.4f}".replace(".", ",") for number in row) for row in rows]
        text = "\n".join(["t;X [mm];Y [mm];Z [mm]", *lines, ""])
        (folder / f"{name}_tracker.csv").write_text(text, encoding="utf-8")


@pytest.mark.validate
def test_a_folder_of_two_devices_leads_to_a_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_folder(tmp_path)
    robot = str(THREE / "robot.toml")
    log = ["fit.mat", "--tracker", "fit_tracker.csv"]
    assert run(["check", robot, *log]) == 2
    assert "tautwire columns fit.mat" in capsys.readouterr().out
    assert run(["columns", "fit.mat", robot, *log[1:], "--out", "columns.toml"]) == 0
    proposed = Path("columns.toml").read_text(encoding="utf-8")
    factors = re.findall(r"rope_length_.*factor = (\S+) ", proposed)
    assert [float(factor) for factor in factors] == pytest.approx(3 * [LENGTH_PER_COUNT], rel=2e-3)
    # The comment beside the factor asks for that of the data sheet.
    from_data_sheet = re.sub(r"factor = \S+ ", f"factor = {LENGTH_PER_COUNT} ", proposed)
    Path("columns.toml").write_text(from_data_sheet, encoding="utf-8")
    assert run(["check", robot, *log, "--columns", "columns.toml"]) == 0
    assert "whose clock shows 23.0" in capsys.readouterr().err
    other = ["--check", "check.mat", "--check-tracker", "check_tracker.csv"]
    assert run(["trace", robot, *log, *other, "--columns", "columns.toml", "--out", "report"]) == 0
    report = json.loads(Path("report/report.json").read_text(encoding="utf-8"))
    (effect,) = report["effects"]
    assert (report["verdict"], effect["name"]) == ("effects", "damping")
    damping = effect["parameters"]["damping"]
    assert damping["low"] < 2.08e9 < damping["high"] and damping["value"] == pytest.approx(2.08e9, rel=0.03)
