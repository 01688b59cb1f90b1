"""One run: numbers that depend on the plan and the run alone, FMUs built once, failures as rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from tautwire.campaigns.campaign_plan import Plan, PlanError
from tautwire.campaigns.campaign_run import Job, build_context, run_job
from tautwire.campaigns.campaign_runner import path_recordings
from tautwire.campaigns.fmu_cache import FmuBundle, build_bundle, cached_fmus, structure_digest
from tautwire.campaigns.parameter_space import with_values
from tautwire.campaigns.plan_file import read_plan
from tautwire.control import ClosedLoopOptions, cosimulate_closed_loop
from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.linear import linearise
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import robot_from_content
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.campaigns import AT_REST, moving, plan_file, read
from tests.support.robots import EXAMPLES, LIMITED, example, with_winch

VALUES = (1.04e11, 310.0)
# N, a limit that the example with eight cables keeps.
HIGH = 20_000.0


def varied(plan: Plan, values: tuple[float | str, ...] = VALUES) -> Robot:
    """The robot of a run."""
    return robot_from_content(with_values(plan.content, dict(zip(plan.keys, values, strict=True))), plan.file)


def test_native_fmus_are_other_ones_and_run_as_those_of_python(tmp_path: Path) -> None:
    robot = example("three")
    native = replace(robot, native_fmus=True)
    assert structure_digest(native) != structure_digest(robot)
    time, speed = np.array([0.0, 0.1, 0.2]), np.array([[0.0] * 3, [0.05] * 3, [0.0] * 3])
    runs = []
    for kind, each in (("python", robot), ("native", native)):
        changed = replace(each, platform=replace(each.platform, mass=310.0))
        runs.append(cosimulate(cached_fmus(changed, build_bundle(each), tmp_path / kind), time, speed))
    assert runs[1].position == pytest.approx(runs[0].position, abs=1e-11)


def test_a_campaign_that_prefers_native_fmus_runs_them_also_for_other_structures(tmp_path: Path) -> None:
    plan = read(tmp_path, moving())
    contexts = {kind: build_context(plan, {}, prefers_native=kind == "native") for kind in ("native", "python")}
    rows = [run_job(context, Job(3, 3, 0, VALUES), tmp_path / kind).row for kind, context in contexts.items()]
    native, python = ({key: value for key, value in row.items() if isinstance(value, float)} for row in rows)
    assert native == pytest.approx(python, rel=1e-9) and rows[0].keys() == rows[1].keys() and "failure" not in rows[0]
    damped = example("three").with_effect(EffectSetting("damping", {"damping": 2e9}, (1, 2, 3)))
    is_machine_code = {}
    for kind, context in contexts.items():
        assert context.bundle is not None
        with ZipFile(cached_fmus(damped, context.bundle, tmp_path / kind).platform) as archive:
            is_machine_code[kind] = "sources/all.c" in archive.namelist()
    assert is_machine_code == {"native": True, "python": False}


def test_statics_and_modes_are_those_of_the_varied_robot(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    row = run_job(build_context(plan, {}), Job(3, 3, 0, VALUES), tmp_path).row
    robot = varied(plan)
    tensions = [row[f"static_tension_{cable}"] for cable in (1, 2, 3)]
    assert tensions == static_tensions(robot).tolist() and row["held"] is True
    plant = linearise(robot)
    assert [row[f"frequency_{mode}"] for mode in (1, 2, 3)] == plant.modes.frequencies.tolist()
    least = (2.0 * np.pi * plant.modes.frequencies[0]) ** 2 * robot.platform.mass
    assert row["stiffness_least"] == pytest.approx(least, rel=1e-6)
    assert row["cable.modulus"] == VALUES[0] and row["index"] == 3 and "failure" not in row


@pytest.mark.validate
def test_a_motion_is_that_of_fmus_built_for_the_varied_robot(tmp_path: Path) -> None:
    plan = read(tmp_path, moving())
    shared = build_context(plan, {})
    result = run_job(shared, Job(0, 0, 0, VALUES), tmp_path / "kept")
    drive = shared.reference_inputs[0]
    assert drive.winch_speeds is not None and drive.desired_position is not None
    motion = cosimulate(build_fmus(varied(plan), tmp_path / "built"), drive.time, drive.winch_speeds)
    assert [result.row[f"end_{axis}"] for axis in "xyz"] == motion.position[-1].tolist()
    assert result.row["tension_2_largest"] == motion.tension[:, 1].max()
    apart = np.linalg.norm(motion.position - drive.desired_position, axis=1)
    assert result.row["path_error_largest"] == apart.max() > 0.0
    assert result.row["slack"] is False and "limit_broken" not in result.row
    assert result.series["time"].tolist() == pytest.approx(np.linspace(0.0, 0.15, 5).tolist())
    assert result.series["z"][-1] == motion.position[-1, 2]


@pytest.mark.validate
def test_controllers_are_designed_for_the_declared_robot_by_default(tmp_path: Path) -> None:
    plan = read(tmp_path, moving().replace("5.001", "5.02").replace("duration = 0.1", "duration = 0.8"))
    row = run_job(build_context(plan, {}), Job(1, 0, 1, VALUES), tmp_path / "kept").row
    assert row["controller"] == "feedforward"
    shared = build_context(replace(plan, belief="varied"), {})
    knowing = run_job(shared, Job(1, 0, 1, VALUES), tmp_path / "kept").row
    assert not shared.reference_inputs
    assert knowing["path_error_largest"] < 0.1 * row["path_error_largest"]


@pytest.mark.validate
def test_noise_of_sensors_depends_on_seed_and_run_alone(tmp_path: Path) -> None:
    text = moving().replace('"feedforward"', '"lqg"').replace("[compute]", "[compute]\nnoise = true")
    plan = read(tmp_path, text)
    shared = build_context(plan, {})
    one, again, other = (run_job(shared, Job(i, 0, 1, VALUES), tmp_path / "kept").row for i in (1, 1, 3))
    assert one == again
    assert one["end_z"] != other["end_z"]
    drive = shared.reference_inputs[1]
    assert drive.design is not None and drive.trajectory is not None
    seed = int(np.random.SeedSequence((plan.seed, 1)).generate_state(1)[0])
    fmus = build_fmus(varied(plan), tmp_path / "built")
    motion = cosimulate_closed_loop(
        fmus,
        drive.nominal_robot,
        drive.design,
        drive.trajectory,
        0.15,
        ClosedLoopOptions(seed=seed, reference=drive.reference),
    )
    assert one["end_z"] == motion.position[-1, 2]


@pytest.mark.validate(but=["feedforward-1"])
@pytest.mark.parametrize(("controller", "variant"), [("feedforward", 0), ("feedforward", 1), ("lqg", 1)])
def test_outputs_are_true_whatever_sensors_show(controller: str, variant: int, tmp_path: Path) -> None:
    plan = plan_file(tmp_path, moving().replace('"feedforward"', f'"{controller}"'))
    with (tmp_path / "robot.toml").open("a", encoding="utf-8") as robot_file:
        robot_file.write("[effect.sensor_offset]\ntension_offset = -2e3\nposition_offset_x = 0.02\n")
        robot_file.write("[effect.sensor_gain]\ntension_gain = 1.1\nposition_gain = 1.01\n")
    shared = build_context(read_plan(plan), {})
    row = run_job(shared, Job(0, 0, variant, VALUES), tmp_path / "kept").row
    assert "failure" not in row
    assert variant or (shared.bundle and (tmp_path / "kept" / shared.bundle.structure).is_dir())
    # The path is a millimetre long, and moves as slowly as tensions of statics allow.
    assert np.allclose([row[f"end_{axis}"] for axis in "xyz"], (28.86, 0.0, 5.0), atol=0.1)
    assert row["slack"] is False
    for cable in (1, 2, 3):
        assert row[f"tension_{cable}_least"] == pytest.approx(row[f"static_tension_{cable}"], rel=0.2)


@pytest.mark.validate
@pytest.mark.parametrize("changed", ["damping", "winch", "eight"])
def test_numbers_set_in_fmus_do_what_numbers_built_into_them_do(changed: str, tmp_path: Path) -> None:
    base = example("eight" if changed == "eight" else "three")
    if changed == "winch":
        base = with_winch(base, LIMITED)
    if changed == "damping":
        base = base.with_effect(EffectSetting("damping", {"damping": 1e9}, base.cable_numbers))
        base = base.with_effect(EffectSetting("payload", {"mass": 3.0}))
    other = replace(base, platform=replace(base.platform, mass=1.05 * base.platform.mass))
    anchors = (replace(c, anchor=(c.anchor[0] + 0.1, c.anchor[1], c.anchor[2]), area=0.9 * c.area) for c in base.cables)
    other = replace(other, cables=tuple(anchors), gravity=9.7)
    if changed == "damping":
        other = other.with_effect(EffectSetting("damping", {"damping": 2e9}, base.cable_numbers))
    if changed == "winch":
        other = with_winch(other, replace(LIMITED, bandwidth=6.0))
    assert structure_digest(other) == structure_digest(base)
    time = np.linspace(0.0, 0.2, 21)
    speeds = 0.05 * np.sin(20.0 * time)[:, None] * np.ones(base.cable_count)
    bundle = build_bundle(base)
    result = cosimulate(cached_fmus(other, bundle, tmp_path / "kept"), time, speeds)
    built = cosimulate(build_fmus(other, tmp_path / "built"), time, speeds)
    # Not to the bit: nominal values, which scale what the coupling calls agreement, stay those built in.
    assert np.allclose(result.position, built.position, rtol=1e-12, atol=0.0)
    assert np.allclose(result.tension, built.tension, rtol=1e-9, atol=0.0)


@pytest.mark.validate
def test_a_law_may_vary_and_has_fmus_of_its_own(tmp_path: Path) -> None:
    plan = read(
        tmp_path,
        moving().replace(
            "cable.modulus = {normal = [1.022e11, 2.2e9]}", 'cable.law = {list = ["linear", "logarithmic"]}'
        ),
    )
    shared = build_context(plan, {})
    linear, other = (
        run_job(shared, Job(i, i, 0, (law, 310.0)), tmp_path / "kept").row
        for i, law in enumerate(plan.inputs[0].distribution.texts)
    )
    assert linear["cable.law"] == "linear" and "failure" not in linear and "failure" not in other
    assert len(list((tmp_path / "kept").iterdir())) == 2
    robot = varied(plan, (*plan.inputs[0].distribution.texts[:1], 310.0))
    speeds = shared.reference_inputs[0].winch_speeds
    assert speeds is not None
    motion = cosimulate(build_fmus(robot, tmp_path / "built"), shared.reference_inputs[0].time, speeds)
    assert (
        [linear[f"end_{axis}"] for axis in "xyz"]
        == motion.position[-1].tolist()
        != [other[f"end_{axis}"] for axis in "xyz"]
    )


@pytest.mark.validate
def test_a_robot_of_another_structure_gets_fmus_of_its_own_once(tmp_path: Path) -> None:
    base = example("three")
    other = base.with_effect(EffectSetting("payload", {"mass": 3.0}))
    bundle = FmuBundle(structure_digest(base), {"platform": b"no FMU"})
    first = cached_fmus(other, bundle, tmp_path)
    made = first.platform.stat().st_mtime_ns
    again = cached_fmus(other.with_effect(EffectSetting("payload", {"mass": 4.0})), bundle, tmp_path)
    assert again.platform == first.platform and again.platform.stat().st_mtime_ns == made
    assert [each.name for each in tmp_path.iterdir()] == [structure_digest(other)]


def test_a_path_is_read_by_the_columns_of_the_robot_file(tmp_path: Path) -> None:
    (tmp_path / "speeds.csv").write_text("time,drive1,drive2,drive3\n0,1,2,3\n0.1,1,2,3\n", encoding="utf-8")
    plan = plan_file(tmp_path, AT_REST + '[[path]]\nname = "log"\nrecording = "speeds.csv"\n')
    with (tmp_path / "robot.toml").open("a", encoding="utf-8") as robot_file:
        robot_file.write('[recording.columns]\n"winch_speed_{}" = { name = "drive{}", unit = "mm/s", sign = -1 }\n')
    read_back = read_plan(plan)
    robot = robot_from_content(dict(read_back.content), read_back.file)
    speeds = path_recordings(read_back, robot)["log"].winch_speed
    np.testing.assert_allclose(speeds, [[-0.001, -0.002, -0.003]] * 2)


@pytest.mark.validate
def test_a_recorded_path_starts_where_its_recording_starts(tmp_path: Path) -> None:
    header = "time,winch_speed_1,winch_speed_2,winch_speed_3,x,y,z"
    rows = [f"{0.01 * row},0,0,0,28.9,0.1,5.4" for row in range(6)]
    (tmp_path / "speeds.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    plan = plan_file(tmp_path, AT_REST + '[[path]]\nrecording = "speeds.csv"\n')
    with (tmp_path / "robot.toml").open("a", encoding="utf-8") as robot_file:
        robot_file.write("[effect.sensor_offset]\nposition_offset_z = 0.1\n")
    read_back = read_plan(plan)
    recordings = path_recordings(read_back, robot_from_content(dict(read_back.content), read_back.file))
    row = run_job(build_context(read_back, recordings), Job(0, 0, 0, VALUES), tmp_path / "kept").row
    assert [row[f"end_{axis}"] for axis in "xyz"] == pytest.approx([28.9, 0.1, 5.3], abs=1e-6)
    plan.write_text(plan.read_text(encoding="utf-8").replace("platform.mass", '"platform.start[1]"'), encoding="utf-8")
    with pytest.raises(PlanError, match="has a start of its own"):
        read_plan(plan)


@pytest.mark.validate
@pytest.mark.parametrize("softness", [0.0, 20.0])
def test_a_cable_is_slack_where_nothing_pulls_at_it(softness: float, tmp_path: Path) -> None:
    # Paid out faster than the platform falls, then held.
    times = np.linspace(0.0, 0.6, 61)
    speeds = np.interp(times, (0.0, 0.1, 0.2, 0.3), (0.0, -3.0, -3.0, 0.0))
    rows = [f"{time},{speed},{speed},{speed}" for time, speed in zip(times, speeds, strict=True)]
    header = "time,winch_speed_1,winch_speed_2,winch_speed_3"
    (tmp_path / "speeds.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    text = """
robot = "robot.toml"
[sample]
method = "grid"
[vary]
"effect.slack.softness" = {list = [0.0, 20.0]}
[[path]]
recording = "speeds.csv"
until = 0.04
[[path]]
name = "all"
recording = "speeds.csv"
"""
    plan = read(tmp_path, text)
    shared = build_context(plan, path_recordings(plan, robot_from_content(dict(plan.content), plan.file)))
    begun, whole = (run_job(shared, Job(i, 0, i, (softness,)), tmp_path / "kept").row for i in (0, 1))
    assert begun["slack"] is False and whole["slack"] is True
    least = min(whole[f"tension_{cable}_least"] for cable in (1, 2, 3))
    assert 0.0 <= least <= softness * np.log(2.0)


def test_a_run_that_fails_is_a_row_with_its_reason_and_what_came_before(tmp_path: Path) -> None:
    plan = read(
        tmp_path,
        AT_REST.replace("platform.mass = {uniform = [280.0, 320.0]}", '"platform.start[3]" = {uniform = [5.0, 60.0]}'),
    )
    shared = build_context(plan, {})
    above = run_job(shared, Job(0, 0, 0, (1e11, 55.0)), tmp_path).row
    assert above["held"] is False and above["failure"].startswith("UnreachableError: ")
    below = run_job(shared, Job(1, 1, 0, (1e11, 6.0)), tmp_path).row
    assert below["held"] is True and "failure" not in below
    wrong = run_job(shared, Job(2, 2, 0, (-1e11, 6.0)), tmp_path).row
    assert "must be above 0 Pa" in wrong["failure"] and "held" not in wrong
    assert all("\n" not in row["failure"] for row in (above, wrong))


@pytest.mark.validate
def test_a_machine_that_fails_is_no_row(tmp_path: Path) -> None:
    plan = read(tmp_path, moving())
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(OSError):
        run_job(build_context(plan, {}), Job(0, 0, 0, VALUES), tmp_path / "file" / "folder")


@pytest.mark.validate
def test_recorded_winch_speeds_are_a_path_and_limits_of_tension_are_held_against_the_robot_file(tmp_path: Path) -> None:
    lines = (EXAMPLES / "eight" / "fit.csv").read_text(encoding="utf-8").splitlines()
    (tmp_path / "speeds.csv").write_text("\n".join(lines[:80]), encoding="utf-8")
    text = f"""
robot = "robot.toml"
[sample]
method = "grid"
[vary]
"tension.maximum" = {{list = [{HIGH}, {0.5 * HIGH}]}}
[[path]]
recording = "speeds.csv"
until = 0.3
"""
    plan = read(tmp_path, text, "eight")
    shared = build_context(plan, {"path 1": read_recording(tmp_path / "speeds.csv", 8)})
    row = run_job(shared, Job(0, 0, 0, (HIGH,)), tmp_path / "kept").row
    assert row["path"] == "path 1" and "path_error_rms" not in row and row["limit_broken"] is False
    largest = max(row[f"tension_{cable}_largest"] for cable in range(1, 9))
    held = max(row[f"static_tension_{cable}"] for cable in range(1, 9))
    assert largest > held
    between = run_job(shared, Job(1, 1, 0, (0.5 * (largest + held),)), tmp_path / "kept").row
    assert between["limit_broken"] is True and "failure" not in between
