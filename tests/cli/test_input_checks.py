"""All problems of a robot file and a recording are listed at once, each with its line."""

from pathlib import Path

import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tautwire.cli import input_checks, run
from tautwire.cli.input_checks import Problem, check_files
from tautwire.errors import InputError, RecordingError, RobotFileError
from tautwire.estimation import trace
from tautwire.recordings.recording import read_recording
from tautwire.robot.implausible_units import implausible_units
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.own_fmus import packed
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"

WRONG = """\
name = 3
gravty = 9.81

[platform]
mass = -80.0
start = [10.0,
    nan, 4.0]

[tension]
minimum = 500.0
maximum = 100.0

[[cable]]
anchor = [0.0, 0.0, 12.0]
area = 3.2e-6
law = "logaritmic"

[[cable]]
anchor = [20, 0, 12]
modulus = "a"
area = 3.2e-6
law = "linear"

[[cable]]
anchor = [20, 0, 12]
modulus = 1e11
area = 3.2e-6
law = "linear"

[effect.dampin]
damping = 3

[[effect.damping]]
damping = 1e99
cables = [7, 2]

[formula]
force_x = "-20*q"
"""
ABOUT = {
    (1, "name"),
    (2, "gravty"),
    (5, "platform.mass"),
    (6, "platform.start[2]"),
    (9, "tension.preferred"),
    (10, "tension.minimum"),
    (13, "cable[1].modulus"),
    (16, "cable[1].law"),
    (20, "cable[2].modulus"),
    (25, "cable[3].anchor"),
    (30, "effect.dampin"),
    (34, "effect.damping[1].damping"),
    (35, "effect.damping[1].cables"),
    (38, "formula.force_x"),
}


def written(folder: Path, text: str, name: str = "robot.toml") -> Path:
    place = folder / name
    place.write_text(text, encoding="utf-8")
    return place


def about(problem: Problem) -> tuple[int | None, str]:
    """The line and the key of a problem, after checking that its text names both."""
    before, _, key = problem.where.rpartition(", ")
    assert before == f"{problem.file}: line {problem.line}"
    assert problem.problem and problem.hint
    return problem.line, key


def test_all_problems_of_a_robot_file_are_listed_with_their_lines(tmp_path: Path) -> None:
    checked = check_files(written(tmp_path, WRONG))
    assert {about(problem) for problem in checked.problems} == ABOUT
    lines = [problem.line for problem in checked.problems]
    assert lines == sorted(lines, key=int)


@pytest.mark.parametrize("newline", ["\r\n", "\n"])
def test_lines_count_the_same_with_windows_line_ends(tmp_path: Path, newline: str) -> None:
    place = tmp_path / "robot.toml"
    place.write_bytes(WRONG.replace("\n", newline).encode())
    assert {about(problem) for problem in check_files(place).problems} == ABOUT


def test_reading_raises_what_checking_tells_first(tmp_path: Path) -> None:
    place = written(tmp_path, WRONG.replace("name = 3", "").replace("gravty", "gravity"))
    with pytest.raises(RobotFileError) as caught:
        read_robot(place)
    assert caught.value.key_path == ("platform", "mass")
    assert caught.value.problem == check_files(place).problems[0].problem


def test_what_is_no_toml_has_its_line(tmp_path: Path) -> None:
    (problem,) = check_files(written(tmp_path, "name = 'a'\ngravity = \n")).problems
    assert (problem.line, problem.where) == (2, f"{tmp_path / 'robot.toml'}: line 2")


def test_a_start_that_cables_cannot_hold_has_its_line(tmp_path: Path) -> None:
    text = (THREE / "robot.toml").read_text(encoding="utf-8").replace("[28.86, 0.0, 5.0]", "[-30.0, 0.0, 5.0]")
    (problem,) = check_files(written(tmp_path, text)).problems
    assert text.split("\n")[int(problem.line or 0) - 1].startswith("start = ")
    assert "cannot be held" in problem.problem


def test_each_fmu_that_does_not_fit_is_listed(tmp_path: Path) -> None:
    text = (THREE / "robot.toml").read_text(encoding="utf-8") + "\n[fmu]\nplatform = 'a.fmu'\ncable_2 = 'b.fmu'\n"
    problems = check_files(written(tmp_path, text)).problems
    assert [text.split("\n")[int(problem.line or 0) - 1][:8] for problem in problems] == ["platform", "cable_2 "]


def test_problems_of_fmus_and_formulas_are_listed_with_all_others(tmp_path: Path) -> None:
    text = (THREE / "robot.toml").read_text(encoding="utf-8").replace("mass = 300.0", "mass = -300.0")
    text += "\n[fmu]\nplatform = 'a.fmu'\ncable_9 = 'b.fmu'\n\n[formula]\nforce_x = '-20*q + foo(p)**2.5'\nmass = 'w'\n"
    problems = check_files(written(tmp_path, text)).problems
    lines = text.split("\n")
    listed = [(lines[int(problem.line or 0) - 1].partition(" ")[0], problem.problem) for problem in problems]
    words = ["-300.0", "a.fmu", "not a known key", "'q'", "function", "'p'", "no small whole power", "'w'"]
    assert [key for key, _ in listed] == ["mass", "platform", "cable_9", *["force_x"] * 4, "mass"]
    for problem, word in zip(problems, words, strict=True):
        assert word in str(problem)


def test_a_start_without_equilibrium_is_listed_beside_unrelated_problems(tmp_path: Path) -> None:
    text = (THREE / "robot.toml").read_text(encoding="utf-8").replace("[28.86, 0.0, 5.0]", "[-30.0, 0.0, 5.0]")
    problems = check_files(written(tmp_path, f"{text}\n[winch]\ndrum_radius = -1.0\n")).problems
    assert ["cannot be held" in problem.problem for problem in problems] == [True, False]


def test_an_fmu_of_one_instance_in_two_slots_is_listed(tmp_path: Path) -> None:
    single = {'canGetAndSetFMUstate="true"': 'canBeInstantiatedOnlyOncePerProcess="true"'}
    packed(tmp_path / "once.fmu", b"", single)
    text = (THREE / "robot.toml").read_text(encoding="utf-8") + "\n[fmu]\nwinch_1 = 'once.fmu'\nwinch_2 = 'once.fmu'\n"
    (problem,) = check_files(written(tmp_path, text)).problems
    assert "can be instantiated only once" in problem.problem
    assert text.split("\n")[int(problem.line or 0) - 1] == "[fmu]"


def test_all_problems_of_a_recording_are_listed_with_their_lines(tmp_path: Path) -> None:
    lines = (THREE / "fit.csv").read_text(encoding="utf-8").split("\n")[:30]
    lines[0] = lines[0].replace("winch_speed_2", "winch_2").replace(",x,", ",y,")
    lines[4] += ",7"
    lines[7] = lines[7].replace(lines[7].split(",")[5], "fast")
    lines[8] = "0.01" + lines[8][lines[8].index(",") :]
    problems = check_files(THREE / "robot.toml", written(tmp_path, "\n".join(lines), "fit.csv")).problems
    assert [problem.line for problem in problems] == [1, 1, 5, 8, 9]
    words = ("'y' appears twice", "winch_speed_2 is missing", "11 cells", "'fast'", "must rise")
    assert all(word in problem.problem for word, problem in zip(words, problems, strict=True))


def test_problems_of_robot_file_and_recording_are_listed_together(tmp_path: Path) -> None:
    robot = written(tmp_path, (THREE / "robot.toml").read_text(encoding="utf-8").replace("mass = 300", "mass = -300"))
    recording = written(tmp_path, "time,winch_speed_1\n0,0\n1,1\n", "fit.csv")
    files = [problem.file for problem in check_files(robot, recording).problems]
    assert files == [str(robot)] + [str(recording)] * 2


HEADER = "time,winch_speed_1,winch_speed_2,winch_speed_3,tension_1"


def test_alike_errors_are_one_problem_with_their_number(tmp_path: Path) -> None:
    rows = [f"{k},0,0,{k},{k}" for k in range(900)]
    for k in (5, 6, 7, 800):
        rows[k] = f'{k},0,0,{k},"1,{k}"'
    rows[9], rows[10], rows[20], rows[30] = "9,0,0,inf,5", "10,0,0,-inf,5", "20,0,0,it's,x", "0,0,0,0,0"
    rows[40], rows[50] = "40,0,0", "50,0,0"
    place = written(tmp_path, "\n".join([HEADER, *rows]), "fit.csv")
    problems = [str(problem) for problem in check_files(THREE / "robot.toml", place).problems]
    said = [
        "line 7, column tension_1: is '1,5', not a number (and 3 more like it, last in line 802); write it with",
        "line 11, column winch_speed_3: is 'inf', must be finite (and 1 more like it, last in line 12); write",
        'line 22, column winch_speed_3: is "it\'s", not a number; write',
        "line 22, column tension_1: is 'x', not a number; write",
        "line 32, column time: is 0.0 after 29.0, must rise from sample to sample; sort",
        "line 42: has 3 cells, the header has 5 (and 1 more like it, last in line 52); complete",
    ]
    assert [
        problem.removeprefix(f"{place}: ")[: len(start)] for problem, start in zip(problems, said, strict=True)
    ] == said


def test_the_number_of_counted_errors_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(input_checks, "MAX_COUNTED_ERRORS", 100)
    rows = "".join(f"{k},a,b,c,\n" for k in range(40))
    checked = check_files(THREE / "robot.toml", written(tmp_path, f"{HEADER}\n{rows}", "fit.csv"))
    assert [problem.problem for problem in checked.problems] == [
        "is 'a', not a number (and 33 more like it, last in line 35)",
        "is 'b', not a number (and 32 more like it, last in line 34)",
        "is 'c', not a number (and 32 more like it, last in line 34)",
    ]
    assert checked.notes[-1].endswith("only the first 100 wrong cells are counted")


def test_the_number_of_listed_problems_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(input_checks, "MAX_PROBLEMS_PER_FILE", 2)
    place = written(tmp_path, f"{HEADER}\n0,a,b,c,0\n1,0,0,0,0\n", "fit.csv")
    checked = check_files(THREE / "robot.toml", place)
    assert len(checked.problems) == 2
    assert checked.notes[-1].endswith("only the first 2 problems are listed")


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_nothing_is_wrong_with_what_is_shipped(name: str) -> None:
    checked = check_files(EXAMPLES / name / "robot.toml", EXAMPLES / name / "fit.csv")
    assert checked.problems == ()


def test_notes_say_what_a_trace_would_do(tmp_path: Path) -> None:
    frame = pd.read_csv(THREE / "fit.csv").rename(columns={"x": "east"})
    frame.loc[100, "tension_2"] += 500.0
    place = tmp_path / "fit.csv"
    frame.to_csv(place, index=False)
    notes = " ".join(check_files(THREE / "robot.toml", place).notes)
    assert "east" in notes and "tension_2" in notes


@pytest.mark.parametrize("key", ["mass_uncertainty = 1.0", ""], ids=["stated", "none"])
def test_a_robot_whose_numbers_are_all_exact_is_told_how_to_state_uncertainties(key: str, tmp_path: Path) -> None:
    text = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
    robot = written(tmp_path, text.replace("[sensors]", f"{key}\n\n[sensors]", 1))
    checked = check_files(robot, EXAMPLES / "three" / "fit.csv")
    is_told = any("state mass_uncertainty, modulus_uncertainty, damping_uncertainty" in note for note in checked.notes)
    assert checked.problems == () and is_told == (not key)


def test_a_recording_of_speeds_alone_is_fine_for_simulate(tmp_path: Path) -> None:
    place = tmp_path / "speeds.csv"
    pd.read_csv(THREE / "fit.csv")[["time", *(f"winch_speed_{i}" for i in (1, 2, 3))]].to_csv(place, index=False)
    checked = check_files(THREE / "robot.toml", place)
    assert checked.problems == () and "trace does not" in checked.notes[-1]


@pytest.mark.validate
def test_a_recording_in_other_units_is_refused_by_check_and_trace_in_the_same_words(tmp_path: Path) -> None:
    frame = pd.read_csv(THREE / "fit.csv")
    frame["time"] *= 1e3
    frame[["tension_1", "tension_2", "tension_3"]] /= 1e3
    place = tmp_path / "fit.csv"
    frame.to_csv(place, index=False)
    (problem,) = check_files(THREE / "robot.toml", place).problems
    assert "time is in ms" in problem.problem and "are in kN" in problem.problem
    robot = read_robot(THREE / "robot.toml")
    with pytest.raises(RecordingError) as caught:
        trace(robot, read_recording(place, 3))
    assert str(caught.value) == str(problem)


def test_check_that_is_fit_is_refused() -> None:
    robot = read_robot(THREE / "robot.toml")
    fit = read_recording(THREE / "fit.csv", 3)
    with pytest.raises(RecordingError, match="has all of its 4001 samples in common with FIT") as caught:
        trace(robot, fit, read_recording(THREE / "fit.csv", 3))
    assert "a recording of another motion" in caught.value.hint


@pytest.mark.validate
def test_check_reads_the_second_recording_and_tells_a_copy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    second, fit = tmp_path / "second.csv", pd.read_csv(THREE / "fit.csv")
    fit[500:].assign(time=fit["time"][500:] - 5.0).round(5).to_csv(second, index=False)
    files = [str(THREE / "robot.toml"), str(THREE / "fit.csv"), "--check"]
    assert run(["check", *files, str(second)]) == 2
    assert "samples in common with FIT" in capsys.readouterr().out
    assert run(["check", *files, str(THREE / "check.csv")]) == 0
    shown = capsys.readouterr()
    assert f"{THREE / 'check.csv'}: no problems found" in shown.out
    assert f"--check {THREE / 'check.csv'} --out report/" in shown.err
    second.write_text("time,winch_speed_1\n0,0\n", encoding="utf-8")
    assert run(["check", *files, str(second)]) == 2
    assert str(second) in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "said"),
    [(["--check", "second.csv"], "--check"), (["--check-tracker", "tracker.csv"], "--check-tracker")],
)
def test_options_of_a_second_recording_need_it(
    capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    assert run(["check", str(THREE / "robot.toml"), *options]) == 2
    assert f"{said}: is given without" in capsys.readouterr().err


LINES = (THREE / "robot.toml").read_text(encoding="utf-8").split("\n")
WRITTEN = ("-1", "0", "nan", "1e99", "'a'", "[]", "[1, 2, 3]", "{}", "true", "[[", '"""', "\n[effect.x]\n", "")
VALUES = st.sampled_from(WRITTEN)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.dictionaries(st.integers(0, len(LINES) - 1), VALUES, max_size=4))
def test_it_tells_nothing_only_of_what_can_be_read(tmp_path: Path, changes: dict[int, str]) -> None:
    lines = [f"{line.partition('=')[0]}= {changes[k]}" if k in changes else line for k, line in enumerate(LINES)]
    place = written(tmp_path, "\n".join(lines))
    problems = check_files(place).problems
    try:
        robot = read_robot(place)
        static_tensions(robot)
        sound = not list(implausible_units(robot, str(place)))
    except InputError as error:
        sound = False
        assert error.problem in {problem.problem for problem in problems}
    assert sound == (problems == ())
