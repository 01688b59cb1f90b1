"""The tracer's benchmark on robots as they are: its cases, and what it counts as right; no recording is traced here."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tautwire_fmu.laws.effects import ALL, BY_NAME
from tests.bench.trace import document, tables
from tests.bench.trace import lifelike_cases as lifelike_module
from tests.bench.trace import recordings as recordings_module
from tests.bench.trace.cases import Case
from tests.bench.trace.lifelike_cases import NEVER_PLANAR, LifelikeCase, lifelike_cases
from tests.bench.trace.line import Line, NamedEffect, line_from
from tests.bench.trace.platform_cases import platform_cases
from tests.bench.trace.recordings import material
from tests.bench.trace.run import finished
from tests.bench.trace.score import held, named, outcome, scored
from tests.bench.trace.selection import case_called, lifelike_alarm_cases
from tests.rig.lifelike.case import lifelike
from tests.rig.lifelike.hidden import HIDDEN, HIDDEN_ON_PLATFORMS, ON_PLATFORMS

BY_KEY = {case.key: case for case in lifelike_cases()}
DAMPING, FORM = BY_KEY["lifelike-damping-3"], BY_KEY["lifelike-friction-linear-3"]
PAIR, SWING = BY_KEY["lifelike-pulley+friction-linear-3"], BY_KEY["lifelike-swing-3"]
EMPTY = lifelike_alarm_cases(1)[0]
SIZES = {"fit": [2e-3, 30.0], "check": [1e-3, 20.0]}
LITTLE = {"fit": [1e-4, 1.0], "check": [1e-4, 1.0]}


def answer(
    case: Case, *names: str, verdict: str = "effects", shares: dict[str, float] | None = None, **truth: Any
) -> Line:
    given = shares or {}
    effects = tuple(
        NamedEffect(name, () if BY_NAME[name].component == "platform" else (1, 2, 3), {}, given.get(name, 0.9))
        for name in names
    )
    hidden: dict[str, Any] = {name: {} for name in case.names}
    truth = {
        "minor": ["drag"],
        "cables": 3,
        "parameters": hidden,
        "size_of_hidden_rms": SIZES,
        "size_of_little_rms": LITTLE,
        **truth,
    }
    return Line(case.key, "f", "c", verdict=verdict, effects=effects, truth=truth)


def test_the_cases_hide_everything_that_the_rig_can_hide() -> None:
    cases = lifelike_cases()
    assert len(BY_KEY) == len(cases)
    assert {key for case in cases if len(case.hide) == 1 for key in case.hide} == set(HIDDEN)
    kinds = {"right": "listed", "wrong": "form", "unlisted": "unlisted"}
    for case in cases:
        if len(case.hide) == 1:
            assert case.kind == kinds[HIDDEN[case.hide[0]].manner]
        assert not (case.planar and set(case.hide) & set(NEVER_PLANAR))
    assert {case.cables for case in cases if case.hide} == {3, 4, 6, 8}
    assert len({case.own_seed for case in (*cases, *lifelike_alarm_cases(200))}) == len(cases) + 200  # type: ignore[attr-defined]


def test_platforms_hide_all_that_only_they_have_and_what_others_have_too() -> None:
    cases = platform_cases()
    assert len({case.key for case in cases}) == len({case.own_seed for case in cases}) == len(cases)
    hidden = {key for case in cases for key in case.hide}
    assert {part.key for part in ON_PLATFORMS} <= hidden
    assert {part.name for part in map(HIDDEN_ON_PLATFORMS.get, hidden) if part} >= {
        effect.name for effect in ALL if effect.needs_rigid_body
    }
    for exact in (True, False):
        for kind in ("listed", "unlisted", "empty"):
            assert {case.cables for case in cases if case.exact == exact and case.kind == kind} == {4, 8}
    assert all(case.turning for case in cases)
    assert case_called("platform-exact-inertia-8").names == {"inertia"}


def test_a_lifelike_case_is_found_by_its_name() -> None:
    assert case_called("lifelike-alarm-012") == lifelike_alarm_cases(13)[12]
    assert case_called("lifelike-swing-3") == SWING


def test_an_answer_serves_again_while_the_rig_is_the_same() -> None:
    line = replace(answer(SWING, verdict="discovered"), fingerprint=SWING.fingerprint({}), code="one")
    assert finished([SWING, DAMPING], [line], "one") == {SWING.key: line}
    assert finished([SWING], [replace(line, fingerprint="other")], "one") == {}
    assert finished([SWING], [line], "two") == {}
    newest = replace(line, code="two")
    assert finished([SWING], [line, newest]) == {SWING.key: newest}


def test_another_rig_makes_lifelike_recordings_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = DAMPING.fingerprint({})
    assert before == DAMPING.fingerprint({}) != FORM.fingerprint({})
    (tmp_path / "friction.py").write_text("changed")
    monkeypatch.setattr(lifelike_module, "RIG", tmp_path)
    lifelike_module._rig_version.cache_clear()
    assert DAMPING.fingerprint({}) != before
    lifelike_module._rig_version.cache_clear()


@pytest.mark.validate
def test_a_case_is_made_once_and_gives_robot_recordings_and_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []

    def short(seed: int, hide: tuple[str, ...], **others: Any) -> Any:
        made.append(seed)
        return lifelike(seed, hide, duration=4.0, rate=50.0, cables=3, planar=False)

    monkeypatch.setattr(recordings_module, "lifelike", short)
    first, again = (material(EMPTY, tmp_path) for _ in range(2))
    assert len(made) == 1
    assert first.robot == again.robot
    assert len(first.robot.cables) == first.truth["cables"] == 3
    assert first.robot.cables[0].anchor_uncertainty > 0.0
    assert len(first.fit.time) == len(first.check.time) == 201
    assert first.truth["effect"] == "none"


@pytest.mark.parametrize(
    ("case", "line", "expected"),
    [
        (DAMPING, answer(DAMPING, "damping"), "right"),
        (DAMPING, answer(DAMPING, "damping", "drag", shares={"drag": 0.03}), "right"),
        (DAMPING, answer(DAMPING, "damping", "drag", shares={"drag": 0.06}), "little"),
        (DAMPING, answer(DAMPING, "damping", "friction", shares={"friction": 0.03}), "wrong"),
        (DAMPING, answer(DAMPING, "drag", shares={"drag": 0.03}), "missed"),
        (DAMPING, answer(DAMPING, verdict="none"), "missed"),
        (DAMPING, answer(DAMPING, verdict="unexplained"), "abstained"),
        (FORM, answer(FORM, "friction"), "right"),
        (FORM, answer(FORM, "friction", "sensor_gain"), "wrong"),
        (PAIR, answer(PAIR, "pulley"), "part"),
        (PAIR, answer(PAIR, "pulley", "friction"), "right"),
        (SWING, answer(SWING, verdict="discovered"), "right"),
        (SWING, answer(SWING, "modulus"), "wrong"),
        (EMPTY, answer(EMPTY, verdict="none"), "right"),
        (EMPTY, answer(EMPTY, "drag", shares={"drag": 0.7}), "little"),
        (EMPTY, answer(EMPTY, "drag", "friction"), "wrong"),
        (SWING, answer(SWING, "drag"), "wrong"),
        (EMPTY, answer(EMPTY, verdict="unexplained"), "alarm"),
    ],
)
def test_right_are_the_hidden_names_beside_little_things_of_little_share(
    case: LifelikeCase, line: Line, expected: str
) -> None:
    assert outcome(case, line) == expected


def measured(case: Case, name: str, parameter: str, low: float, high: float, **hidden: Any) -> Line:
    effect = NamedEffect(name, (1, 2, 3), {parameter: ((low + high) / 2, low, high)}, 0.9)
    return replace(answer(case, parameters=hidden), effects=(effect,))


def test_intervals_count_only_where_the_form_is_that_of_the_list() -> None:
    for high, inside in ((1.2e9, True), (0.99e9, False)):
        line = measured(DAMPING, "damping", "damping", 0.9e9, high, damping={"damping": 1e9})
        (one,) = held(scored([DAMPING], {DAMPING.key: line}))
        assert one.inside is inside
    wrong = measured(FORM, "friction", "coefficient", 0.1, 0.2, friction={"coefficient": 0.15, "form": "linear"})
    assert held(scored([FORM], {FORM.key: wrong})) == ()


def test_names_are_counted_where_they_hide_and_elsewhere() -> None:
    lines = {
        DAMPING.key: answer(DAMPING, "damping", "friction"),
        FORM.key: answer(FORM, verdict="unexplained"),
        EMPTY.key: answer(EMPTY, verdict="none"),
    }
    answers = scored([DAMPING, FORM, EMPTY], lines)
    counts = {one.name: (one.hidden, one.named, one.missed, one.wrong) for one in named(answers)}
    assert counts == {"damping": (1, 1, 0, 0), "friction": (1, 0, 1, 1)}
    assert "| friction | 1 | 0 | 1 | 1 |" in tables.names(answers)


def test_a_lifelike_line_survives_its_file() -> None:
    line = replace(answer(DAMPING, "damping"), small=("drag",), left_share=0.2)
    assert line_from(line.text()) == line
    old = {key: value for key, value in json.loads(line.text()).items() if key not in ("truth", "small", "left_share")}
    del old["effects"][0]["share"]
    assert line_from(json.dumps(old)).effects[0].share is None


def test_the_page_shows_lifelike_answers_beside_the_others() -> None:
    lines = {
        DAMPING.key: answer(DAMPING, "damping"),
        SWING.key: answer(SWING, verdict="discovered"),
        EMPTY.key: replace(answer(EMPTY, verdict="none"), code="older"),
    }
    answers, empty = scored([DAMPING, SWING], lines), scored([EMPTY], lines)
    text = document.page("", document.lifelike(answers) | document.lifelike_alarms(empty))
    assert "sources c (2)." in text
    assert "sources older (1)." in text
    assert "| lifelike-damping-3 | 10, 20 | damping | right |" in text
    assert "0 of 1 (0.0 %, 95 %: 0.0 to 97.5 %)" in text


def test_the_page_shows_platforms_that_turn_also_where_no_little_thing_is() -> None:
    exact = case_called("platform-exact-inertia-8")
    line = answer(exact, "inertia", size_of_little_rms={"check": [0.0, 0.0]})
    text = document.page("", document.platforms(scored([exact], {exact.key: line})))
    assert "| platform-exact-inertia-8 | -, - | inertia | right |" in text
