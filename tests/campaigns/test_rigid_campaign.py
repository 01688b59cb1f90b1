"""Campaigns of platforms that turn: what varies, the columns of their poses, and their pages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire.campaigns.campaign_dataset import PartWriter, open_dataset
from tautwire.campaigns.campaign_plan import Plan, PlanError
from tautwire.campaigns.campaign_run import RunResult, build_context, run_job
from tautwire.campaigns.campaign_runner import planned_jobs, run_count, write_summary
from tautwire.campaigns.dataset_schema import Row, row_columns, series_columns
from tautwire.campaigns.fmu_cache import build_bundle
from tautwire.campaigns.parameter_space import KeyPathError, with_values
from tautwire.campaigns.plan_file import read_plan
from tautwire.linear import linearise
from tautwire.robot.pose_stiffness import stiffness_matrix
from tautwire.robot.robot_file_reader import read_robot, robot_from_content
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.pages import Page, section_of
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES

VARIED = """
robot = "robot.toml"
[sample]
method = "sobol"
count = 2
[vary]
"platform.inertia[1][2]" = {uniform = [-0.5, 0.5]}
"platform.centre_of_mass[3]" = {uniform = [0.2, 0.3]}
"cable[2].attachment[1]" = {uniform = [-0.55, -0.45]}
"cable[*].modulus" = {normal = [1e11, 1e9]}
"""
TURNING = """
[compute]
settle = 0.03
series = 4
[[path]]
name = "turn"
end = [0.3, -0.2, 1.502]
end_orientation = [0.99995, 0.0, 0.0, 0.01]
duration = 0.12
"""


def plan_of(folder: Path, text: str) -> Plan:
    write_robot(crane_robot(), folder / "robot.toml")
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return read_plan(folder / "plan.toml")


def test_inertia_centre_of_mass_and_attachments_vary(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, VARIED)
    (job, *_), context = planned_jobs(plan, np.ones(run_count(plan), dtype=bool)), build_context(plan, {})
    row = run_job(context, job, tmp_path / "fmus").row
    assert "failure" not in row
    values = dict(zip(plan.keys, job.values, strict=True))
    robot = read_robot(tmp_path / "robot.toml")
    assert robot.platform.inertia is not None
    first, second, third = (list(line) for line in robot.platform.inertia)
    first[1] = second[0] = values["platform.inertia[1][2]"]
    attachment = (values["cable[2].attachment[1]"], *robot.cables[1].attachment[1:])
    cables = [replace(each, modulus=values[f"cable[{i}].modulus"]) for i, each in enumerate(robot.cables, start=1)]
    cables[1] = replace(cables[1], attachment=attachment)
    centre = (*robot.platform.centre_of_mass[:2], values["platform.centre_of_mass[3]"])
    platform = replace(robot.platform, inertia=(tuple(first), tuple(second), tuple(third)), centre_of_mass=centre)
    varied = replace(robot, platform=platform, cables=tuple(cables))
    assert [row[f"static_tension_{i}"] for i in range(1, 9)] == pytest.approx(static_tensions(varied).tolist())
    frequencies = linearise(varied).modes.frequencies
    assert [row[f"frequency_{mode}"] for mode in range(1, 7)] == pytest.approx(frequencies.tolist())
    compliance = np.linalg.inv(stiffness_matrix(varied))[:3, :3]
    assert row["stiffness_least"] == pytest.approx(1.0 / np.linalg.eigvalsh(compliance)[-1], rel=1e-6)


@pytest.mark.validate
def test_a_run_along_a_turning_path_has_its_orientations(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, 'robot = "robot.toml"\ncontrollers = ["feedforward"]\n' + TURNING)
    context = build_context(plan, {})
    (job,) = planned_jobs(plan, np.ones(run_count(plan), dtype=bool))
    result = run_job(context, job, tmp_path / "fmus")
    assert result.row["path_error_angle_largest"] < 1e-3 and result.row["path_error_largest"] < 1e-3
    end = [result.row[f"end_q{part}"] for part in "wxyz"]
    assert end == pytest.approx([0.99995, 0.0, 0.0, 0.01], abs=2e-4)
    assert tuple(result.series) == ("time", *series_columns(8, True))
    assert result.series["qz"][-1] == pytest.approx(end[3])
    names = {column.name for column in row_columns(plan, 8)}
    assert set(result.row) <= names and {"frequency_6", "end_qw", "path_error_angle_rms"} <= names


def test_page_and_summary_have_rotations_about_each_axis_in_mrad(tmp_path: Path) -> None:
    start = np.array([np.cos(0.1), np.sin(0.1), 0.0, 0.0])
    path = TURNING.replace("end =", f"start_orientation = {start.tolist()}\nend =")
    plan, out = plan_of(tmp_path, VARIED.replace("count = 2", "count = 16") + path), tmp_path / "out"
    columns, names = row_columns(plan, 8), ("time", *series_columns(8, True))
    angles = 0.004 * np.arange(1, run_count(plan) + 1)
    with open_dataset(out, plan), PartWriter(out, columns) as parts:
        for index, angle in enumerate(angles.tolist()):
            row: Row = {each.name: 0.01 * (1 + index) for each in columns if each.kind == "number"}
            row |= {each.name: False for each in columns if each.kind == "flag"}
            row |= {"index": index, "sample": index, "path": "turn", "controller": "none"}
            # The product of a turn about the world's z axis with the start.
            cosine, sine = np.cos(0.5 * angle), np.sin(0.5 * angle)
            turned = [cosine * start[0], cosine * start[1], sine * start[1], sine * start[0]]
            row |= dict(zip([f"end_q{part}" for part in "wxyz"], turned, strict=True))
            series = {name: np.full(4, 0.01 * index) for name in names}
            parts.add([RunResult(row, series | {f"q{part}": np.full(4, turned[i]) for i, part in enumerate("wxyz")})])
    spreads = {each["name"]: each for each in write_summary(plan, out)["spreads"]}
    assert not any(name.startswith("end_q") for name in spreads)
    assert spreads["end_rotation_z"]["unit"] == "rad" and spreads["end_rotation_z"]["largest"] == pytest.approx(0.064)
    assert spreads["end_rotation_z"]["mean"] == pytest.approx(angles.mean())
    assert abs(spreads["end_rotation_x"]["largest"]) < 1e-12 and abs(spreads["end_rotation_y"]["least"]) < 1e-12
    text = (out / "index.html").read_text(encoding="utf-8")
    (variant,) = Page(text).data()["variants"]
    units = {each["label"]: each["unit"] for each in variant["spreads"]}
    assert (units["path error angle rms"], units["path error rms"], units["end rotation z"]) == ("mrad", "mm", "mrad")
    bands = {each["label"]: each for each in variant["bands"] if each["title"] == "Rotation"}
    assert list(bands) == ["about x", "about y", "about z"] and {each["unit"] for each in bands.values()} == {"mrad"}
    low, high = 1e3 * np.quantile(angles, (0.025, 0.975))
    assert float(bands["about z"]["width"]) == pytest.approx(high - low, rel=1e-2)
    (words,) = (each["words"] for each in variant["spreads"] if each["label"] == "path error angle rms")
    assert words.endswith("mrad") and float(words.split()[0]) > 10.0
    table = section_of(text, "summary").text
    assert "mrad" in table.partition("path error angle rms")[2][:40]


@pytest.mark.validate
def test_cached_fmus_have_the_numbers_of_the_run(tmp_path: Path) -> None:
    """FMUs of the declared robot with other parameters move as FMUs that were built with these numbers."""
    head = VARIED.replace("count = 2", "count = 1")
    plan = plan_of(tmp_path, head + TURNING.replace("[compute]", "[compute]\nmodes = false\nstatics = false"))
    context, (job,) = build_context(plan, {}), planned_jobs(plan, np.ones(run_count(plan), dtype=bool))
    content = with_values(plan.content, dict(zip(plan.keys, job.values, strict=True)))
    varied = robot_from_content(content, plan.file)
    by_parameters = run_job(context, job, tmp_path / "fmus").row
    built = run_job(replace(context, bundle=build_bundle(varied)), job, tmp_path / "others").row
    assert "failure" not in by_parameters and by_parameters["path_error_largest"] > 1e-5
    numbers = [name for name, value in by_parameters.items() if isinstance(value, float)]
    assert [by_parameters[name] for name in numbers] == pytest.approx([built[name] for name in numbers], rel=1e-9)


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("platform.inertia[1]", r"inertia\[1\] is not a number"),
        ("platform.inertia[1][4]", "inertia has no entry 4"),
        ("platform.start_orientation[1]", "start_orientation is not in the robot file"),
        ("platform.centre_of_mass[1][1]", "centre_of_mass is not a matrix"),
    ],
)
def test_keys_that_lead_to_no_number_are_refused(key: str, words: str) -> None:
    inertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    content = {"platform": {"inertia": inertia, "centre_of_mass": [0.0, 0.0, 0.1]}}
    with pytest.raises(KeyPathError, match=words):
        with_values(content, {key: 1.0})


def test_an_entry_across_the_diagonal_follows() -> None:
    content = {"platform": {"inertia": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}}
    changed = with_values(content, {"platform.inertia[1][3]": 0.2})
    assert changed["platform"]["inertia"] == [[1.0, 0.0, 0.2], [0.0, 1.0, 0.0], [0.2, 0.0, 1.0]]


def test_a_point_mass_has_no_path_that_turns(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text((EXAMPLES / "eight/robot.toml").read_text())
    (tmp_path / "plan.toml").write_text('robot = "robot.toml"\n' + TURNING)
    with pytest.raises(PlanError, match=r"path.*end_orientation: turns the platform, which is a point mass"):
        read_plan(tmp_path / "plan.toml")
