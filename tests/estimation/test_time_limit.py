"""A trace that runs out of time: what it found until then, what it left, and no verdict that it has not earned."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from tautwire.errors import NumericalError
from tautwire.estimation import Trace, candidate_scoring, identification, identification_stages, trace, verdict_stages
from tautwire.estimation.candidate_proposals import SearchRound
from tautwire.estimation.candidate_scores import CandidateScore
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification import policy_within
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.identification_stages import SEARCHES, select, separate_cables
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter
from tautwire.estimation.policy import DEFAULT_POLICY
from tautwire.estimation.time_limit import OutOfTimeError, TimeLimit
from tautwire.estimation.worker_pool import WorkerPool
from tautwire.recordings.recording import Recording
from tautwire.reports import trace_table, write_report
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example


class Clock:
    """A clock that stands until it is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_only_a_search_is_ended_and_only_when_its_share_is_used_up() -> None:
    clock = Clock()
    limit = TimeLimit(100.0, clock)
    with limit.searching(0.6):
        clock.now = 59.0
        limit.check()
        clock.now = 61.0
        with pytest.raises(OutOfTimeError, match="time limit of 100 s"):
            limit.check()
    limit.check()
    with limit.searching(0.9):
        limit.check()
    assert limit.elapsed == 61.0


def test_values_of_cables_have_time_where_the_search_used_all_of_its_own() -> None:
    clock = Clock()
    limit = TimeLimit(100.0, clock)
    share_of_selection, share_of_cables = (
        SEARCHES[stage][0](DEFAULT_POLICY.time_limit) for stage in (select, separate_cables)
    )
    with limit.searching(share_of_selection):
        clock.now = 1.001 * limit.seconds * share_of_selection
        with pytest.raises(OutOfTimeError):
            limit.check()
    with limit.searching(share_of_cables):
        limit.check()


def test_what_is_left_untried_is_told_once() -> None:
    limit = TimeLimit()
    for sentence in ("this", "that", "this"):
        limit.leave_untried(sentence)
    assert limit.untried == ("this", "that")


def test_a_short_limit_allows_fewer_samples_down_to_a_least_number() -> None:
    counts = [policy_within(seconds).preprocessing.max_samples for seconds in (1.0, 60.0, 600.0, np.inf)]
    assert counts == [6_000, 12_000, 100_000, 100_000]


@pytest.mark.validate
def test_calls_that_were_dropped_are_ended_and_awaited_ones_begin_anew() -> None:
    begin = time.monotonic()
    with WorkerPool(2) as workers:
        calls = workers.map_unordered(time.sleep, [(0.0,), (1000.0,), (1000.0,)])
        assert next(calls)[0] == 0
        calls.close()
        awaited = workers.submit(sum, [1, 2])
        workers.abandon_calls()
        assert awaited.result() == 3
        assert workers.submit(sum, [3, 4]).result() == 7
    assert time.monotonic() - begin < 100.0


def test_what_was_fitted_in_time_gets_its_baseline_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, robot, recording = Clock(), example("three"), recorded("three", 1)
    limit = TimeLimit(100.0, clock)
    hypothesis = Hypothesis(BY_NAME["drag"], ())
    score = CandidateScore(hypothesis, Fit.without_parameters(robot), 130.0, 1.0)

    def fit_until_time_is_up(*_: object) -> dict[Hypothesis, CandidateScore]:
        clock.now = 99.0
        return {hypothesis: score}

    def awaited() -> float:
        limit.check()
        return 100.0

    noise = estimate_noise(robot, recording)
    workers: Any = SimpleNamespace(submit=lambda *_: SimpleNamespace(result=awaited))
    split = split_data(robot, noise, recording, None)
    context = IdentificationContext(robot, Fitter(noise), split, workers=workers, time_limit=limit)
    monkeypatch.setattr(candidate_scoring, "fit_candidates", fit_until_time_is_up)
    with limit.searching(0.6):
        search_round = SearchRound(1, robot, (), None, is_white=True, has_disturbance=False)
        scores = candidate_scoring._scores_beside_disturbance(context, "round 1", search_round, {})
        with pytest.raises(OutOfTimeError):
            limit.check()
    # There was no time for an exact baseline.
    assert scores[hypothesis].evidence == pytest.approx(30.0 - context.policy.selection.coarse_tie(100.0))


HIDDEN = {"damping": {"damping": 9e8}}


def traced_until(activity: str, fit: Recording, check: Recording) -> Trace:
    """A trace whose clock jumps beyond its limit at some activity."""
    clock = Clock()

    def progress(current: str, fraction: float) -> None:
        if current.startswith(activity):
            clock.now = 601.0

    return trace(example("three"), fit, check, progress, time_limit=TimeLimit(600.0, clock))


@pytest.fixture(scope="module")
def recordings() -> tuple[Recording, Recording]:
    fit, check = (recorded("three", seed, HIDDEN).first(401) for seed in (3, 53))
    return fit, check


@pytest.fixture(scope="module")
def without_time_for_effects(recordings: tuple[Recording, Recording]) -> Trace:
    return traced_until("round 1: score test", *recordings)


@pytest.mark.validate
def test_a_trace_without_time_for_effects_is_unexplained(without_time_for_effects: Trace) -> None:
    found = without_time_for_effects
    assert found.verdict == "unexplained"
    assert found.sentence.startswith("The search ended at its time limit of 600 s. Until then: the residual is not")
    assert found.effects == ()
    assert any("effects" in sentence for sentence in found.untried)
    assert found.robot_after == found.robot_before
    assert found.seconds == 601.0


@pytest.mark.validate
def test_a_trace_without_time_for_effects_tells_where_the_error_sits(without_time_for_effects: Trace) -> None:
    assert "tensions of cables 1, 2, 3 deviate" in without_time_for_effects.components.sentence
    assert not [sentence for sentence in without_time_for_effects.untried if "component" in sentence]


@pytest.mark.validate
def test_effects_found_before_time_was_up_are_reported(recordings: tuple[Recording, Recording]) -> None:
    found = traced_until("intervals", *recordings)
    (effect,) = found.effects
    estimate = effect.parameters["damping"]
    assert estimate.low < estimate.value < estimate.high
    assert estimate.value == pytest.approx(9e8, rel=0.02)
    assert [sentence for sentence in found.untried if "intervals of the parameters" in sentence]
    assert found.identifiability.detectable == ()


@pytest.mark.validate
def test_effects_keep_their_intervals_where_time_ends_at_the_numbers_beside_them(
    recordings: tuple[Recording, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    def out_of_time(*_: object) -> None:
        raise OutOfTimeError(600.0)

    monkeypatch.setattr(verdict_stages, "calibrate_beside_effects", out_of_time)
    robot = example("three")
    robot = replace(robot, platform=replace(robot.platform, mass_uncertainty=0.1))
    found = trace(robot, *recordings)
    (effect,) = found.effects
    assert effect.parameters["damping"].value == pytest.approx(9e8, rel=0.02)
    assert 0.0 < found.robot_after.platform.mass_uncertainty < 0.1
    assert any("uncertain numbers" in sentence for sentence in found.untried)


@pytest.mark.validate
def test_candidates_fitted_before_time_was_up_count(recordings: tuple[Recording, Recording]) -> None:
    found = traced_until("round 1: damping", *recordings)
    assert any(sentence.startswith("There was no time for fits of") for sentence in found.untried)
    assert [effect.name for effect in found.effects] == ["damping"]
    assert found.sentence.endswith("The search ended at its time limit of 600 s, before all was tried.")


def test_the_error_is_localised_before_a_search_that_may_take_all_the_time(
    recordings: tuple[Recording, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[str] = []

    def step(name: str) -> None:
        steps.append(name)
        if name == "selection":
            raise InterruptedError

    monkeypatch.setattr(identification_stages, "localise_residual", lambda *_: step("localisation"))
    monkeypatch.setattr(identification_stages, "select_effects", lambda _: step("selection"))
    with pytest.raises(InterruptedError):
        trace(example("three"), *recordings)
    assert steps == ["localisation", "selection"]


@pytest.mark.validate
def test_nothing_missing_is_never_said_for_lack_of_time() -> None:
    fit, check = (recorded("three", seed, {}).first(401) for seed in (3, 53))
    found = traced_until("round 1", fit, check)
    assert found.verdict == "unexplained"
    assert found.sentence == (
        "The search ended at its time limit of 600 s; until then nothing was found that the model lacks."
    )


def test_numbers_without_a_solution_end_in_an_error_that_can_be_read(
    recordings: tuple[Recording, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(identification, "prepare_data", fail)
    with pytest.raises(NumericalError, match=r"cannot follow this recording \(Singular matrix\)"):
        trace(example("three"), *recordings)


@pytest.mark.validate
def test_the_report_tells_what_was_left(without_time_for_effects: Trace, tmp_path: Path) -> None:
    found = without_time_for_effects
    write_report(found, tmp_path)
    assert tuple(json.loads((tmp_path / "report.json").read_text())["untried"]) == found.untried
    assert found.untried[0] in (tmp_path / "index.html").read_text()
    shown = StringIO()
    Console(file=shown, width=400).print(trace_table(found))
    assert found.untried[0] in shown.getvalue()
