"""Plans: errors of one line with a hint, and the values that are drawn."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from tautwire.campaigns import campaign_runner as writing
from tautwire.campaigns import trace_summary
from tautwire.campaigns.campaign_plan import DISTRIBUTION_KINDS, Compute, Distribution, TracePlan
from tautwire.campaigns.campaign_runner import planned_jobs, run_count
from tautwire.campaigns.input_sampling import correlated_groups, draw_samples
from tautwire.campaigns.parameter_space import KeyPathError, expand_key_path, leaves_of, with_values
from tautwire.campaigns.plan_file import PLAN_KEYS, read_plan
from tautwire.cli import run as command
from tautwire.errors import InputError
from tautwire.estimation.time_limit import DEFAULT_TIME_LIMIT, TimeLimit
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import robot_content
from tests.support.campaigns import AT_REST, moving, plan_file, read
from tests.support.folders import ROOT
from tests.support.robots import EXAMPLES

CONTENT = robot_content(EXAMPLES / "three" / "robot.toml")
NORMAL = '"cable.modulus" = {normal = [1e11, 1e9]}'


def sampled(vary: str, method: str = "sobol", count: int = 8, more: str = "") -> str:
    number = "" if method == "grid" else f"count = {count}"
    return f'robot = "robot.toml"\nseed = 5\n[sample]\nmethod = "{method}"\n{number}\n[vary]\n{vary}\n{more}'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", 'robot: is missing; name the robot file'),
        ("robot = 3", "robot: is 3, not text"),
        ('robot = "other.toml"', "there is no such file"),
        ('robot = "robot.toml"\nsed = 1', "sed: is not a known key; write 'seed'"),
        ('robot = "robot.toml"\nseed = 1.5', "seed: is 1.5, not a whole number"),
        ("robot = ", "is not TOML"),
        (f'robot = "robot.toml"\n[vary]\n{NORMAL}', "sample: is missing"),
        (sampled(NORMAL, "sobel"), "write 'sobol'"),
        (sampled(NORMAL, count=9), "must be a power of 2 for sobol; write 8 or 16"),
        (sampled(NORMAL, "grid"), "lets cable.modulus be normal, a grid requires list or linspace"),
        (sampled(NORMAL, count=2**30), "sample.count: is 1073741824"),
        (sampled(NORMAL, "random", 9_999_999).replace("[sample]", 'controllers = ["none", "lqg"]\n[sample]')
         + '[[path]]\nend = [28.86, 0.0, 6.0]\nduration = 4.0', "makes 19999998 runs"),
        (sampled("cable.modulus = {normal = [1e11]}"), "has 1 numbers, normal takes 2: mean, standard deviation"),
        (sampled("cable.modulus = {normal = [1e11, -1.0]}"), "standard deviation of -1, must be above 0"),
        (sampled("cable.modulus = {uniform = [2.0, 1.0]}"), "goes from 2 to 1, must rise"),
        (sampled("cable.modulus = {triangular = [1.0, 3.0, 2.0]}"), "its most probable value 3 outside 1 to 2"),
        (sampled("cable.modulus = {lognormal = [-1.0, 0.1]}"), "median of -1, must be above 0"),
        (sampled("cable.modulus = {linspace = [1.0, 2.0, 2.5]}"), "has a count of 2.5"),
        (sampled("cable.modulus = {list = []}"), "is empty, a list has one value or more"),
        (sampled("cable.modulus = {list = [nan]}"), "not finite numbers"),
        (sampled('cable.law = {list = ["linear", 2.0]}'), "not finite numbers"),
        (sampled('cable.law = {list = ["linear", "logaritmic", "logarithmic"]}'), "write 'logarithmic'"),
        (sampled('cable.modulus = {list = ["stiff"]}'), "cable[1].modulus is 'stiff', not a number"),
        (sampled("cable.modulus = {gauss = [1.0, 2.0]}"), "vary.cable.modulus: is a table of 1 keys"),
        (sampled("cable.modulus = {list = [1.0], normal = [1.0, 2.0]}"), "is several, not one distribution"),
        (sampled("cable.modulus = 3.0"), "vary.cable.modulus: is 3.0, not one distribution"),
        (sampled('"cable[4].modulus" = {list = [1e11]}'), "cable has no entry 4; give one from 1 to 3"),
        (sampled('"platform.start" = {list = [1.0]}'), "start is not a number in the robot file; name one entry"),
        (sampled('"platform.start[0]" = {list = [1.0]}'), "start has no entry 0"),
        (sampled('"cable modulus" = {list = [1.0]}'), "is not a key path; write it as cable.modulus"),
        (sampled('"platform[*].mass" = {list = [1.0]}'), "platform is not a list in the robot file; leave [*] out"),
        (sampled('"cable.modulos" = {list = [1e11]}'), "modulos is not a known key; write 'modulus'"),
        (sampled('"platform.mass" = {uniform = [-3.0, -2.0]}'), "platform.mass is -2.5, must be above 0 kg"),
        (sampled('"effect.dampin.damping" = {list = [1e9]}'), "is not a known effect"),
        (sampled(NORMAL, more='[[correlation]]\nbetween = ["a"]\nvalue=0.1'),
         "correlation[1].between: does not name two keys"),
        (sampled(NORMAL, more='[[correlation]]\nbetween = ["cable.modulus", "mass"]\nvalue=0.1'),
         "names 'mass', which does not vary"),
        (sampled(NORMAL, more="[compute]\nmodes = 1"), "compute.modes: is 1, not true or false"),
        (sampled(NORMAL, more="[compute]\nmodes = false\nstatics = false"), "leaves nothing to compute"),
        (sampled(NORMAL, more='[[path]]\nname = "up"'), "path[1]: is no path"),
        (sampled(NORMAL, more="[[path]]\nend = [1.0, 2.0]\nduration = 1.0"), "path[1].end: has 2 entries, must have 3"),
        (sampled(NORMAL, more="[[path]]\nend = [1.0, 2.0, 3.0]"), "path[1].duration: is missing"),
        (sampled(NORMAL).replace("[sample]", 'controllers = ["pid"]\n[sample]'), "controllers: has 'pid'"),
        (sampled(NORMAL).replace("[sample]", 'controllers = ["lqg"]\n[sample]'), "have no path to follow"),
        (sampled(NORMAL).replace("[sample]", 'believes = "all"\n[sample]'), 'must be one of "declared", "varied"'),
        (sampled('"platform.start[1]" = {list = [28.0]}',
                 more="[[path]]\nstart = [28.86, 0.0, 5.0]\nend = [28.86, 0.0, 6.0]\nduration = 1.0"),
         "has a start of its own, but platform.start varies"),
        (sampled(NORMAL, more='[found]\nreport = "none.json"'), "there is no such file"),
        ('robot = "robot.toml"\n[trace]\nrecordings = "nowhere"', "no folder; name a folder of recordings"),
        ('robot = "robot.toml"\n[trace]\nrecordings = "."\n[vary]\nx = 1', "vary: is not allowed beside [trace]"),
        ('robot = "robot.toml"\n[trace]\nrecordings = "."', "has no recording in"),
    ],
)  # fmt: skip
def test_invalid_input_is_an_error_of_one_line(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_path_changes_one_number_and_nothing_else() -> None:
    changed = with_values(CONTENT, {"cable[2].anchor[3]": 49.0, "platform.mass": 290.0, "effect.sag.density": 8000.0})
    assert changed["cable"][1]["anchor"] == [0.0, -50.0, 49.0]
    assert changed["platform"]["mass"] == 290.0 and changed["effect"]["sag"] == {"density": 8000.0}
    assert CONTENT["cable"][1]["anchor"] == [0.0, -50.0, 50.0] and "effect" not in CONTENT
    assert changed["cable"][0] == CONTENT["cable"][0]


def test_a_key_without_entry_is_of_all_and_each_entry_of_a_star_is_one() -> None:
    everywhere = with_values(CONTENT, {"cable.modulus": 1e11})
    assert [cable["modulus"] for cable in everywhere["cable"]] == [1e11] * 3
    assert expand_key_path(CONTENT, "cable[*].modulus") == tuple(f"cable[{i}].modulus" for i in (1, 2, 3))
    assert len(expand_key_path(CONTENT, "cable[*].anchor[*]")) == 9
    with pytest.raises(KeyPathError, match="not a list"):
        with_values(CONTENT, {"platform[1].mass": 1.0})


@pytest.mark.parametrize(
    ("distribution", "median", "high"),
    [
        (Distribution("normal", (5.0, 2.0)), 5.0, 5.0 + 2.0 * 1.959963985),
        (Distribution("uniform", (1.0, 3.0)), 2.0, 2.95),
        (Distribution("triangular", (0.0, 1.0, 2.0)), 1.0, 2.0 - np.sqrt(0.05)),
        (Distribution("lognormal", (4.0, 0.5)), 4.0, 4.0 * np.exp(0.5 * 1.959963985)),
        (Distribution("list", (7.0, 8.0, 9.0)), 8.0, 9.0),
        (Distribution("linspace", (0.0, 1.0, 5.0)), 0.5, 1.0),
    ],
)
def test_quantiles_are_those_of_the_distribution(distribution: Distribution, median: float, high: float) -> None:
    assert distribution.quantile(np.array([0.5, 0.975])) == pytest.approx([median, high])


@pytest.mark.parametrize("method", ["sobol", "latin hypercube", "random", "saltelli"])
def test_the_same_seed_gives_the_same_samples_of_the_distributions(method: str, tmp_path: Path) -> None:
    vary = f'{NORMAL}\n"platform.mass" = {{uniform = [280.0, 320.0]}}'
    plan = read(tmp_path, sampled(vary, method, 1024))
    values = draw_samples(plan)
    assert values.shape == (plan.count, 2)
    assert np.array_equal(values, draw_samples(plan))
    other = draw_samples(read(tmp_path, sampled(vary, method, 1024).replace("seed = 5", "seed = 6")))
    assert not np.array_equal(values, other)
    assert np.quantile(values[:, 0], [0.16, 0.5, 0.84]) == pytest.approx([0.99e11, 1e11, 1.01e11], rel=2e-3)
    assert values[:, 1].min() >= 280.0 and values[:, 1].max() <= 320.0
    assert values[:, 1].mean() == pytest.approx(300.0, abs=1.5)


def test_a_grid_has_every_step_of_one_with_every_step_of_another(tmp_path: Path) -> None:
    plan = read(
        tmp_path, sampled("platform.mass = {list = [290, 300]}\ncable.damping = {linspace = [0, 4e8, 3]}", "grid")
    )
    assert draw_samples(plan).tolist() == [[m, d] for m in (290.0, 300.0) for d in (0.0, 2e8, 4e8)]


def test_texts_are_steps_like_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = sampled('platform.mass = {list = [290, 300]}\n"cable[2].law" = {list = ["linear", "logarithmic"]}', "grid")
    plan = read(tmp_path, text)
    wanted = [(290.0, "linear"), (290.0, "logarithmic"), (300.0, "linear"), (300.0, "logarithmic")]
    assert [job.values for job in planned_jobs(plan, np.ones(4, dtype=bool))] == wanted
    assert command(["campaign", str(tmp_path / "plan.toml"), "--dry-run"]) == 0
    assert capsys.readouterr().out.splitlines()[1] == "0,0,290,linear"
    other = read(tmp_path, text.replace('"linear", "logarithmic"', '"logarithmic", "linear"'))
    assert other.digest() != plan.digest()


def test_correlations_are_those_asked_for(tmp_path: Path) -> None:
    more = '[[correlation]]\nbetween = ["cable.modulus", "platform.mass"]\nvalue = -0.8'
    vary = f'{NORMAL}\nplatform.mass = {{normal = [300.0, 5.0]}}\n"cable.damping" = {{uniform = [1e8, 4e8]}}'
    plan = read(tmp_path, sampled(vary, "sobol", 2048, more))
    result = np.corrcoef(draw_samples(plan).T)
    assert result[0, 1] == pytest.approx(-0.8, abs=0.02)
    assert np.abs(result[2, :2]).max() < 0.05
    assert correlated_groups(plan) == (0, 0, 1)
    assert read(tmp_path, sampled(vary, "saltelli", 8, more)).count == 8 * 4


def test_correlations_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    keys = [f"cable[{i}].modulus" for i in (1, 2, 3)]
    pairs = [(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)]
    more = "".join(f"[[correlation]]\nbetween = {[keys[i], keys[k]]}\nvalue = {v}\n" for i, k, v in pairs)
    plan = read(tmp_path, sampled('"cable[*].modulus" = {normal = [1e11, 1e9]}', more=more))
    with pytest.raises(InputError, match="contradict"):
        draw_samples(plan)


def test_paths_and_controllers_multiply_the_samples(tmp_path: Path) -> None:
    plan = read(tmp_path, moving(4))
    assert plan.variants == ((0, "none"), (0, "feedforward")) and run_count(plan) == 8


def test_plans_that_make_other_rows_have_other_digests_wherever_they_stand(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    here, digests = read(tmp_path / "a", AT_REST), []
    assert here.digest() == read(tmp_path / "b", AT_REST).digest()
    assert here.digest() != read(tmp_path / "a", AT_REST.replace("seed = 7", "seed = 8")).digest()
    for content in (b"first", b"second"):
        (tmp_path / "a" / "mine.fmu").write_bytes(content)
        with_fmu = tmp_path / "a" / "robot.toml"
        with_fmu.write_text((EXAMPLES / "three" / "robot.toml").read_text() + '\n[fmu]\nwinch_1 = "mine.fmu"\n')
        digests.append(read_plan(tmp_path / "a" / "plan.toml").digest())
    assert digests[0] != digests[1]
    robot = tmp_path / "b" / "robot.toml"
    robot.write_text(robot.read_text(encoding="utf-8").replace("mass = 300.0", "mass = 301.0"), encoding="utf-8")
    assert here.digest() != read_plan(tmp_path / "b" / "plan.toml").digest()


def test_a_recording_is_left_after_its_second_sample_at_the_earliest(tmp_path: Path) -> None:
    rows = ["time,winch_speed_1,winch_speed_2,winch_speed_3", "0.0,0,0,0", "0.1,0,0,0", "0.2,0,0,0"]
    (tmp_path / "speeds.csv").write_text("\n".join(rows), encoding="utf-8")
    path = '[[path]]\nrecording = "speeds.csv"\nuntil = {}'
    assert read(tmp_path, sampled(NORMAL, more=path.format(0.1))).paths[0].numbers["duration"] == 0.1
    with pytest.raises(InputError, match=r"path\[1\].until: is 0.05, before .* second sample; write 0.1 or more"):
        read(tmp_path, sampled(NORMAL, more=path.format(0.05)))


def test_a_dry_run_prints_the_rows_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = plan_file(tmp_path, moving(4))
    assert command(["campaign", str(file), "--dry-run"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "index,sample,path,controller,cable.modulus,platform.mass" and len(lines) == 9
    assert command(["campaign", str(file), "--dry-run", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert rows[3]["controller"] == "feedforward" and rows[3]["sample"] == 1
    assert sorted(each.name for each in tmp_path.iterdir()) == ["plan.toml", "robot.toml"]


def test_without_a_folder_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["campaign", str(plan_file(tmp_path, AT_REST))]) == 2
    assert "--out: is missing" in capsys.readouterr().err


@pytest.mark.parametrize(("missing", "said"), [("distributed", "dask[distributed]"), ("SALib", "SALib")])
def test_a_library_that_is_missing_is_named_before_anything_is_written(
    missing: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "find_spec", lambda name: None if name == missing else object())
    file = plan_file(tmp_path, AT_REST)
    assert command(["campaign", str(file), "--out", str(tmp_path / "out")]) == 2
    assert f"campaign: needs {said}, which is not installed; run pip install" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_plan_of_the_page_is_one(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "campaign.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    plan = read(tmp_path, text)
    assert run_count(plan) == 512 and plan.keys[0] == "cable[1].modulus"
    for kind in DISTRIBUTION_KINDS:
        assert f"| `{kind}` |" in page
    for key in (*PLAN_KEYS, *(each.name for each in fields(Compute))):
        assert f"`{key}`" in page or f"[{key}]" in page, key


def test_a_key_that_overwrites_another_is_refused(tmp_path: Path) -> None:
    both = '"cable[2].modulus" = {list = [1e11, 1.1e11]}\n"cable.modulus" = {list = [1e11, 1.2e11]}'
    with pytest.raises(InputError, match=r"vary\.cable\.modulus: varies what cable\[2\]\.modulus varies"):
        read(tmp_path, sampled(both, "grid"))
    assert leaves_of(CONTENT, "cable[2].modulus") == {("cable", 1, "modulus")}


@pytest.mark.parametrize(
    "values", ["list = [-280.0, 300.0, 310.0]", "uniform = [-10.0, 400.0]", "linspace = [-9, 300, 4]"]
)
def test_the_ends_of_a_distribution_are_tried(values: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"does not suit the robot file, platform\.mass"):
        read(tmp_path, sampled(f'"platform.mass" = {{{values}}}', "random"))


@pytest.mark.parametrize("is_sqlite", [False, True])
def test_bags_are_recordings_of_a_season_each_by_its_folder(is_sqlite: bool, tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    from tests.support.ros_bags import joint_state, write_bag

    season = tmp_path / "season"
    (season / "pictures").mkdir(parents=True)
    states = [(time, joint_state(time, [0.1, 0.2, 0.3])) for time in (1000.0, 1000.1)]
    folder = write_bag(season / "monday", {"/joint_states": ("sensor_msgs/JointState", states)}, is_sqlite=is_sqlite)
    trace = read(tmp_path, 'robot = "robot.toml"\n[trace]\nrecordings = "season"').trace
    assert trace.recordings == (str(folder),)
    (next(each for each in folder.iterdir() if each.suffix != ".yaml")).write_bytes(b"another")
    assert read(tmp_path, 'robot = "robot.toml"\n[trace]\nrecordings = "season"').trace.digests != trace.digests


def test_the_time_limit_of_traces_belongs_to_a_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def seconds_of(*arguments: object, time_limit: TimeLimit, **options: object) -> None:
        raise ValueError(f"a limit of {time_limit.seconds:g} s")

    monkeypatch.setattr(trace_summary, "trace", seconds_of)
    (tmp_path / "season").mkdir()
    shutil.copyfile(EXAMPLES / "three" / "fit.csv", tmp_path / "season" / "fit.csv")
    text = 'robot = "robot.toml"\n[trace]\nrecordings = "season"\n'
    plans = [read(tmp_path, text + limit) for limit in ("", "time_limit = 600.0\n", "time_limit = 30.0\n")]
    assert plans[0].digest() == plans[1].digest() != plans[2].digest()
    recording = read_recording(tmp_path / "season" / "fit.csv", 3)
    assert TracePlan.time_limit == DEFAULT_TIME_LIMIT
    reasons = [trace_summary.trace_row(plan, 0, recording)["failure"] for plan in plans]
    assert reasons == [f"ValueError: a limit of {seconds} s" for seconds in (600, 600, 30)]
