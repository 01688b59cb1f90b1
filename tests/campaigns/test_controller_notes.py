"""What a campaign says of the controllers that it designs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed", reason='Dask is not installed: pip install "dask[distributed]" SALib')

from tautwire.campaigns.campaign_dataset import PartWriter, open_dataset
from tautwire.campaigns.campaign_plan import Plan
from tautwire.campaigns.campaign_run import RunResult, identifying_columns
from tautwire.campaigns.campaign_runner import planned_jobs, run_count
from tautwire.campaigns.controller_notes import with_controller_notes
from tautwire.campaigns.dataset_schema import row_columns
from tautwire.campaigns.plan_file import read_plan
from tautwire.cli import run as command
from tautwire.control.gain_scheduling import DESIGN_POINTS
from tautwire.robot.robot_file_writer import write_robot
from tests.support.campaigns import read
from tests.support.pages import section_of
from tests.support.rigid_robots import hung_beam, underactuated_robot

PLAN = """
robot = "robot.toml"
controllers = ["feedforward", "lqg"]
[compute]
modes = false
[[path]]
name = "rest"
end = [1.63957, -0.620978, -0.968457]
duration = 0.1
"""
NOTE = "rest, lqg: at [1.63957, -0.620978, -0.968457] m: the loop has a disk margin of 0.003"


def plan_of(folder: Path) -> Plan:
    write_robot(underactuated_robot(), folder / "robot.toml")
    (folder / "plan.toml").write_text(PLAN, encoding="utf-8")
    return read_plan(folder / "plan.toml")


def write_rows(plan: Plan, out: Path) -> None:
    """Rows of all runs, with the same numbers."""
    columns = row_columns(plan, underactuated_robot().cable_count)
    with open_dataset(out, plan), PartWriter(out, columns) as parts:
        for job in planned_jobs(plan, np.ones(run_count(plan), dtype=bool)):
            numbers = {each.name: 0.01 for each in columns if each.kind == "number"}
            parts.add([RunResult({**numbers, **identifying_columns(plan, job)})])


def test_modes_that_winches_hardly_reach_are_named_also_of_robust_controllers(tmp_path: Path) -> None:
    write_robot(hung_beam(), tmp_path / "robot.toml")
    text = PLAN.replace("1.63957, -0.620978, -0.968457", "1.8, 0.0, 1.0").replace('"lqg"', '"robust", "lqg"')
    (tmp_path / "plan.toml").write_text(text, encoding="utf-8")
    robust, lqg = with_controller_notes(read_plan(tmp_path / "plan.toml")).notes
    assert robust.startswith("rest, robust: at [1.8, 0, 1] m: the winches hardly reach the mode of 1.64 Hz")
    assert robust == lqg.replace("lqg", "robust")


@pytest.mark.validate
def test_each_place_of_a_schedule_is_named(tmp_path: Path) -> None:
    notes = with_controller_notes(replace(plan_of(tmp_path), controllers=("scheduled",))).notes
    assert len(notes) == DESIGN_POINTS and all(note.startswith(NOTE.replace("lqg", "scheduled")) for note in notes)


@pytest.mark.validate
def test_a_campaign_says_which_of_its_loops_small_errors_unsettle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan, out = plan_of(tmp_path), tmp_path / "out"
    write_rows(plan, out)
    assert command(["campaign", str(tmp_path / "plan.toml"), "--out", str(out)]) == 0
    assert capsys.readouterr().err.count(NOTE) == 1
    (note,) = json.loads((out / "summary.json").read_text(encoding="utf-8"))["notes"]
    assert note.startswith(NOTE)
    assert NOTE in section_of((out / "index.html").read_text(encoding="utf-8"), "notes").text


@pytest.mark.parametrize("controllers", ('"lqg"', '"robust", "feedforward", "none"'))
def test_nothing_is_said_of_loops_with_enough_margin(tmp_path: Path, controllers: str) -> None:
    path = "[[path]]\nend = [28.86, 0.0, 5.1]\nduration = 1.0\n"
    plan = read(tmp_path, f'robot = "robot.toml"\ncontrollers = [{controllers}]\n{path}')
    assert with_controller_notes(plan).notes == ()
