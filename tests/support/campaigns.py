"""Plans and folders of campaigns that several tests use."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from tautwire.campaigns.campaign_plan import Plan
from tautwire.campaigns.campaign_run import RunResult, build_context, run_job
from tautwire.campaigns.campaign_runner import path_recordings, planned_jobs, run_count
from tautwire.campaigns.plan_file import read_plan
from tautwire.robot.robot_file_reader import robot_from_content
from tests.support.robots import EXAMPLES

AT_REST = """
robot = "robot.toml"
seed = 7
[sample]
method = "sobol"
count = 8
[vary]
cable.modulus = {normal = [1.022e11, 2.2e9]}
platform.mass = {uniform = [280.0, 320.0]}
"""
# A tenth of a second along a short line: a run of little more than the FMUs' coming and going.
MOVING = """
controllers = ["none", "feedforward"]
[compute]
modes = false
settle = 0.05
series = 5
[[path]]
name = "up"
end = [28.86, 0.0, 5.001]
duration = 0.1
"""


def plan_file(folder: Path, text: str, robot: str = "three") -> Path:
    """A plan with a robot file beside it."""
    shutil.copyfile(EXAMPLES / robot / "robot.toml", folder / "robot.toml")
    file = folder / "plan.toml"
    file.write_text(text, encoding="utf-8")
    return file


def moving(count: int = 8) -> str:
    """A plan of two runs a sample along a path."""
    head, rest = AT_REST.replace("count = 8", f"count = {count}").split("[sample]")
    controllers, body = MOVING.split("[compute]")
    return f"{head}{controllers}[sample]{rest}[compute]{body}"


def read(folder: Path, text: str, robot: str = "three") -> Plan:
    """The plan that a text makes."""
    return read_plan(plan_file(folder, text, robot))


def bare_results(plan: Plan, folder: Path) -> list[RunResult]:
    """All runs in a bare loop of this process."""
    robot = robot_from_content(dict(plan.content), plan.file)
    shared = build_context(plan, path_recordings(plan, robot))
    return [run_job(shared, job, folder) for job in planned_jobs(plan, np.ones(run_count(plan), dtype=bool))]
