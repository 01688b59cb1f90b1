"""The tracer's benchmark: its cases, and what it counts as right; no recording is traced here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire_fmu.laws.effects import ALL, BY_NAME
from tests.bench.trace import document
from tests.bench.trace import run as runner
from tests.bench.trace.__main__ import FEWEST_ALARMS, finished_sections
from tests.bench.trace.cases import SIZES, Case, Kind, Part, main_cases, quick_cases
from tests.bench.trace.figure import confusion_figure, save
from tests.bench.trace.forms import FORMS, LISTED, UNLISTED
from tests.bench.trace.line import Line, NamedEffect, Used, keep, line_from, line_of, read_lines
from tests.bench.trace.motion import declared
from tests.bench.trace.score import confusion, held, outcome, rate, scored
from tests.bench.trace.selection import alarm_cases, case_called, chosen
from tests.bench.trace.sizes import NATS, Stage, stored, strengths
from tests.bench.trace.truth import Interval, holds, in_one_way, law_values
from tests.bench.trace.visible import drift_columns, hiding
from tests.rig import EFFECTS, RampProgram, simulate
from tests.support.effect_cases import CASES
from tests.support.effect_cases import Case as EffectCase
from tests.support.robots import NAMES
from tests.support.traces import made_trace

# Effects of the rig that only lifelike recordings hide.
LIFELIKE_ALONE = {"unlisted_gusts", "unlisted_slipping"}
BY_KEY = {case.key: case for case in (*main_cases(), *quick_cases())}
DAMPING = BY_KEY["quick-damping"]
TRUE_DAMPING = 4e8 * (1 + strengths(DAMPING)["damping"])


def case_of(kind: Kind, *forms: str) -> Case:
    return Case("made", kind, "three", tuple(Part(FORMS[form], "middle") for form in forms))


def answer(case: Case, *names: str, verdict: str = "effects", also: tuple[tuple[str, ...], ...] = ()) -> Line:
    cables = {name: () if BY_NAME[name].component == "platform" else (1, 2, 3) for name in names}
    effects = tuple(NamedEffect(name, cables[name], {}) for name in names)
    return Line(case.key, "f", "c", verdict=verdict, effects=effects, also_possible=also)


def test_the_cases_are_all_that_was_asked_for() -> None:
    cases = main_cases()
    assert len({case.key for case in cases}) == len(cases) >= 60
    listed = {
        (name, part.size) for case in cases if case.kind == "listed" for part in case.parts for name in case.names
    }
    assert listed == {(effect.name, size) for effect in ALL if effect.forms_on(is_rigid_body=False) for size in SIZES}
    unlisted = [case.parts[0].form.name for case in cases if case.kind == "unlisted"]
    assert set(unlisted) == set(EFFECTS) - set(BY_NAME) - LIFELIKE_ALONE
    assert len(unlisted) >= 10
    for kind in ("listed", "pair", "unlisted", "empty"):
        assert {case.robot for case in cases if case.kind == kind} == set(NAMES)
    assert {part.form.key for case in cases for part in case.parts} == {form.key for form in (*LISTED, *UNLISTED)}


def test_a_case_is_found_by_its_name_and_by_a_part_of_it() -> None:
    assert case_called("alarm-007") == alarm_cases(8)[7]
    assert case_called("quick-creep") is not None
    assert {case.key for case in chosen(main_cases(), ["unlisted-wave", "*three-small"])} == {
        "unlisted-wave-three",
        *(key for key in BY_KEY if key.endswith("three-small")),
    }
    with pytest.raises(KeyError):
        case_called("nothing-like-it")


def test_fit_and_check_and_other_cases_have_seeds_of_their_own() -> None:
    seeds = [case.seed(which) for case in (*main_cases(), *alarm_cases(200)) for which in ("fit", "check")]
    assert len(set(seeds)) == len(seeds)


def test_every_case_has_a_stored_size() -> None:
    for case in BY_KEY.values():
        assert set(strengths(case)) == {part.form.key for part in case.parts}
        for part in case.parts:
            size = stored()[case.key][part.form.key]
            assert 0.0 < size.strength <= part.form.most
            assert size.nats > 50.0, case.key
            if size.strength < part.form.most and part.form.listed:
                assert 0.5 < size.nats / NATS[part.size] < 2.0, case.key


@pytest.mark.validate
def test_a_stored_size_shows_as_much_as_it_says() -> None:
    case = BY_KEY["quick-damping"]
    size = stored()[case.key]["damping"]
    stage = Stage(case)
    assert stage.nats(FORMS["damping"], size.strength) == pytest.approx(size.nats, rel=0.02)
    assert stage.nats(FORMS["damping"], 0.0) == pytest.approx(0.0, abs=1e-6)


def test_visibility_is_that_of_the_dense_formula() -> None:
    random = np.random.default_rng(1)
    change, free = random.normal(size=(30, 4)), random.normal(size=(30, 4))
    drift = random.normal(size=(30, 4, 5))
    columns = np.column_stack([drift.reshape(120, 5), 1e4 * free.ravel(), 1e4 * np.tile(np.eye(4), (30, 1))])
    expected = 0.5 * change.ravel() @ np.linalg.solve(np.eye(120) + columns @ columns.T, change.ravel())
    result = hiding(drift, [free])
    assert result.nats(change) == pytest.approx(expected, rel=1e-6)
    assert result.nats(3.0 * free + 5.0) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.validate
def test_drift_columns_are_what_longer_ropes_do() -> None:
    stage = Stage(Case("made", "empty", "three", ()))
    robot = replace(stage.robot, noise=replace(stage.robot.noise, winch_speed=1.0))
    columns = drift_columns(robot, 1.0, stage.plain[:1, 3:], stage.plain[:1, :3])
    # A rope that winds in slowly by 1 mm, at the start.
    slow = RampProgram(np.array([1e-5, 0.0, 0.0]), 1e-4)
    run = simulate(replace(robot, damping=20.0 * robot.damping), {}, slow, [0.0, 14.6421])
    wound = -slow.travel(14.6421)[0]
    assert run.position[-1] - run.position[0] == pytest.approx(wound * columns[0, 3:, 0], rel=0.01, abs=2e-6)
    assert run.tension[-1] - run.tension[0] == pytest.approx(wound * columns[0, :3, 0], rel=0.02, abs=0.02)


def test_what_changed_makes_recordings_anew() -> None:
    effects = DAMPING.effects(strengths(DAMPING))
    assert DAMPING.fingerprint(effects) == DAMPING.fingerprint(dict(effects))
    assert DAMPING.fingerprint(effects) != DAMPING.fingerprint({"damping": {"damping": 1.0}})
    assert DAMPING.fingerprint({}) != replace(DAMPING, robot="eight").fingerprint({})


@pytest.mark.parametrize("one", CASES, ids=str)
def test_values_of_the_rig_become_those_of_the_laws(one: EffectCase) -> None:
    results = {name: Interval(value, value, value) for name, value in law_values(one.name, one.rig).items()}
    expected = in_one_way(one.name, {name: Interval(value, value, value) for name, value in one.law.items()})
    assert {k: v.value for k, v in results.items()} == pytest.approx({k: v.value for k, v in expected.items()})


def test_an_eccentricity_below_zero_is_one_above_it_half_a_turn_on() -> None:
    result = in_one_way("drum", {"eccentricity": Interval(-0.02, -0.03, -0.01), "phase": Interval(-2.1, -2.2, -2.0)})
    assert result["eccentricity"] == (0.02, 0.01, 0.03)
    assert holds("drum", "phase", 1.0, result["phase"])
    assert holds("drum", "phase", 1.0 + 4 * np.pi, result["phase"])
    assert not holds("drum", "phase", 1.2, result["phase"])


@pytest.mark.parametrize(
    ("hidden", "names", "also", "expected"),
    [
        (("damping",), ("damping",), (), "right"),
        (("damping-one",), ("damping",), (), "place"),
        (("damping", "payload"), ("damping",), (), "part"),
        (("damping", "payload"), ("payload", "damping"), (), "right"),
        (("damping",), ("damping", "payload"), (), "wrong"),
        (("damping",), ("relaxation",), (), "wrong"),
        (("damping",), ("relaxation",), (("relaxation", "damping"),), "ambiguous"),
        (("damping", "payload"), ("relaxation",), (("damping", "payload"),), "ambiguous"),
        (("damping", "payload"), ("relaxation", "payload"), (("relaxation", "damping"),), "ambiguous"),
        (("damping",), ("relaxation", "payload"), (("relaxation", "damping"),), "wrong"),
    ],
)
def test_names_are_held_against_what_is_hidden(
    hidden: tuple[str, ...], names: tuple[str, ...], also: tuple[tuple[str, ...], ...], expected: str
) -> None:
    case = replace(DAMPING, parts=tuple(Part(FORMS[form], "middle") for form in hidden))
    assert outcome(case, answer(case, *names, also=also)) == expected


@pytest.mark.parametrize(
    ("kind", "verdict", "expected"),
    [
        ("empty", "none", "right"),
        ("empty", "unexplained", "alarm"),
        ("unlisted", "none", "missed"),
        ("unlisted", "discovered", "right"),
        ("listed", "none", "missed"),
        ("pair", "unexplained", "abstained"),
    ],
)
def test_abstention_is_right_only_off_the_list(kind: Kind, verdict: str, expected: str) -> None:
    case = case_of(kind)
    assert outcome(case, answer(case, verdict=verdict)) == expected


def test_any_name_is_wrong_where_no_listed_effect_hides() -> None:
    for kind in ("empty", "unlisted"):
        case = case_of(kind)
        assert outcome(case, answer(case, "damping")) == "wrong"
    assert outcome(case_of("unlisted"), answer(case_of("unlisted"), "damping", verdict="discovered")) == "wrong"
    assert outcome(case, Line(case.key, "f", "c", failure="Traceback")) == "failed"


def measured(low: float, high: float) -> Line:
    effect = NamedEffect("damping", (1, 2, 3), {"damping": ((low + high) / 2, low, high)})
    return Line(
        DAMPING.key, "f", "c", "effects", "said", (effect,), (), (3e-3, 9.0), (3e-4, 2.0), (3e-4, 2.0), 9.0, 300.0
    )


def test_intervals_are_held_against_the_truth() -> None:
    for factor, inside in ((1.0, True), (1.05, False)):
        line = measured(0.99 * factor * TRUE_DAMPING, 1.01 * factor * TRUE_DAMPING)
        (one,) = held(scored([DAMPING], {DAMPING.key: line}))
        assert one.inside is inside
        assert one.truth == pytest.approx(TRUE_DAMPING)
    unfitted = measured(TRUE_DAMPING, TRUE_DAMPING)
    assert held(scored([DAMPING], {DAMPING.key: unfitted})) == ()


def test_a_rate_has_an_exact_interval() -> None:
    none = rate(0, 200)
    assert none.low == 0.0
    assert none.high == pytest.approx(1.0 - 0.025 ** (1 / 200))
    assert rate(0, 0).high == 1.0


def test_a_line_says_what_the_trace_said() -> None:
    trace = made_trace()
    line = line_of("made", "f", "c", trace, Used(8.0, 300.0))
    assert (line.verdict, line.names) == ("effects", {"damping"})
    assert line.effects[0].parameters["damping"] == (2.1034e9, 2.05e9, 2.16e9)
    assert line.after == (trace.comparisons[1].errors_after.position_rms, trace.comparisons[1].errors_after.tension_rms)
    assert line.also_possible == trace.also_possible
    assert line.rivals[0].name == "damping"
    assert line.rivals[0].accepted
    assert not any(np.isnan(rival.mean_square) for rival in line.rivals)


def test_a_line_survives_its_file_and_a_cut_one_is_left_out(tmp_path: Path) -> None:
    line = line_of("made", "f", "c", made_trace(), Used(8.0, 300.0))
    assert line_from(line.text()) == line
    path = tmp_path / "results.jsonl"
    path.write_text(f"{line.text()}\n{line.text()[:30]}", encoding="utf-8")
    assert read_lines(path) == (line,)
    assert read_lines(tmp_path / "none.jsonl") == ()


def test_the_newest_answer_of_each_case_is_kept_without_rivals(tmp_path: Path) -> None:
    path, line = tmp_path / "answers.jsonl", line_of("made", "f", "one", made_trace(), Used(8.0, 300.0))
    other = replace(line, key="another")
    assert keep(path, [line, other]) == read_lines(path) == (replace(other, rivals=()), replace(line, rivals=()))
    newer = replace(line, code="two", rivals=(), failure="Traceback\n  in a file\nValueError: none")
    assert keep(path, [newer])[1] == read_lines(path)[1] == replace(newer, failure="ValueError: none")


def test_what_no_tracer_has_answered_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cases, asked = alarm_cases(3), []

    def alone(case: Case, folder: Path, code: str) -> Line:
        asked.append(case.key)
        return Line(case.key, case.fingerprint({}), code, verdict="none")

    monkeypatch.setattr(runner, "_alone", alone)
    kept = [Line(case.key, case.fingerprint({}), code) for case, code in zip(cases, ("old", "new"), strict=False)]
    runner.run(cases, tmp_path, "new", 1, lambda case, line: None, kept)
    assert asked == [cases[2].key, cases[0].key]


def test_a_second_call_goes_on_where_the_first_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = alarm_cases(3)
    asked: list[str] = []

    def alone(case: Case, folder: Path, code: str) -> Line:
        asked.append(case.key)
        return Line(case.key, case.fingerprint({}), code, verdict="none")

    monkeypatch.setattr(runner, "_alone", alone)
    runner.run(cases[:2], tmp_path, "one", 1, lambda case, line: None)
    (tmp_path / "results.jsonl").open("a", encoding="utf-8").write('{"key": "cut')
    result = runner.run(cases, tmp_path, "one", 2, lambda case, line: None)
    assert sorted(asked) == [case.key for case in cases]
    assert sorted(result) == [case.key for case in cases]
    assert len(read_lines(tmp_path / "results.jsonl")) == 3
    runner.run(cases, tmp_path, "another tracer", 1, lambda case, line: None)
    assert len(asked) == 6


def test_a_process_that_dies_leaves_a_line_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "ONE", "tests.bench.trace.no_such_module")
    (case,) = alarm_cases(1)
    line = runner.run([case], tmp_path, "one", 1, lambda case, line: None)[case.key]
    assert "no_such_module" in line.failure
    assert outcome(case, line) == "failed"


def test_the_matrix_the_picture_and_the_page_show_each_answer(tmp_path: Path) -> None:
    empty = alarm_cases(2)
    pair = next(case for case in main_cases() if case.kind == "pair")
    lines = {
        DAMPING.key: measured(0.99 * TRUE_DAMPING, 1.01 * TRUE_DAMPING),
        pair.key: answer(pair, *pair.names),
        empty[0].key: Line(empty[0].key, "f", "c", verdict="none"),
        empty[1].key: Line(empty[1].key, "f", "c", failure="Traceback"),
    }
    answers = scored((DAMPING, pair, *empty), lines)
    rows, columns, counts = confusion(answers)
    assert rows == ["damping", pair.label, "nothing"]
    assert set(columns) == {"damping", *pair.names, "none", "failed"}
    assert counts[rows.index("nothing"), columns.index("failed")] == 1
    assert counts.sum(axis=1).tolist() == [1, 2, 2]
    path = tmp_path / "matrix.svg"
    save(confusion_figure(answers), str(path))
    drawn = path.read_bytes()
    assert b"nothing" in drawn
    save(confusion_figure(answers), str(path))
    assert path.read_bytes() == drawn
    sections = document.exact(answers, path.name) | document.exact_alarms(scored(empty, lines))
    text = document.page("", sections)
    assert path.name in text
    assert "0 of 1 (0.0 %, 95 %: 0.0 to 97.5 %)" in text
    assert "1 of 1 (100.0 %" in text


def test_a_part_made_anew_leaves_the_other_parts_of_the_page_as_they_stand() -> None:
    answers = scored([DAMPING], {DAMPING.key: measured(0.99 * TRUE_DAMPING, 1.01 * TRUE_DAMPING)})
    empty = alarm_cases(1)
    alarms = document.exact_alarms(scored(empty, {empty[0].key: Line(empty[0].key, "f", "later", verdict="none")}))
    exact = document.page("", document.exact(answers, "picture.svg"))
    both = document.page(exact, alarms)
    assert both.index("## Outcomes") < both.index("## False alarms") < both.index("## What was hidden")
    assert both.replace(f"## False alarms\n\n{alarms['## False alarms']}\n\n", "") == exact
    assert document.page(both, alarms) == both
    with pytest.raises(KeyError, match="Later"):
        document.page("## Later\n\ntext\n", alarms)


def test_only_parts_whose_every_case_has_an_answer_go_to_the_page() -> None:
    def none(case: Case) -> Line:
        return Line(case.key, case.fingerprint(case.effects(strengths(case))), "c", verdict="none")

    alarms = tuple(map(none, alarm_cases(FEWEST_ALARMS)))
    assert set(finished_sections(alarms)) == {document.EXACT_ALARMS}
    assert finished_sections(alarms[:-1]) == {}
    assert finished_sections(tuple(map(none, main_cases()[1:]))) == {}


@pytest.mark.validate
def test_the_robots_move_within_their_ropes() -> None:
    for name in NAMES:
        stage = Stage(Case("made", "empty", name, ()))
        assert stage.plain[:, : declared(name).count].min() > 0.0
