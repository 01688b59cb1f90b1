"""Unlisted effects in the place of listed ones that look like them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import inf
from typing import Any

import pytest

from tautwire.errors import UnreachableError
from tautwire.estimation import confusable_models, trace
from tautwire.estimation.confusable_models import replace_by_confusable_models
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import DataSet, split_data
from tautwire.estimation.hypotheses import Hypothesis, hypotheses
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.innovations import Innovations
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.selection_result import SelectionResult, with_disturbance_beside
from tautwire.robot.schema import Robot
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

FRAME = {"unlisted_frame": {"stiffness_constant": 3e6, "viscosity": 2e3, "mass": 50.0}}
SOFTER = {"modulus": {"modulus": 0.97e11, "cables": [1, 2]}}
SOFT_FRAME = {"unlisted_frame": {"stiffness_constant": 5e5, "viscosity": 2e3, "mass": 50.0}}
ALL_SOFTER = {"modulus": {"modulus": 0.97e11}}


def judged(hidden: dict[str, Any], chosen: list[Hypothesis], beside_disturbance: bool = False) -> SelectionResult:
    """What rivals leave of these hypotheses, fitted to recordings that hide something."""
    robot = example("three")
    noise = estimate_noise(robot, recorded("three", 9, hidden))
    evidence = split_data(robot, noise, recorded("three", 9, hidden), recorded("three", 59, hidden))
    if beside_disturbance:
        noise = replace(noise, disturbance=disturbance_prior(robot, noise).median)
    fitter, start = Fitter(noise), robot
    for hypothesis in chosen:
        start = start.with_effect(hypothesis.setting(robot))
    fit = fitter.fit_from([start], chosen, evidence.estimation, -inf)
    context, fit = with_disturbance_beside(IdentificationContext(robot, fitter, evidence), chosen, fit)
    alike = tuple((hypothesis.effect.name, "creep") for hypothesis in chosen)
    found = SelectionResult(tuple(chosen), (100.0,) * len(chosen), fit, (), alike)
    return replace_by_confusable_models(context, found)[1]


@pytest.mark.validate
def test_a_softer_rope_keeps_its_name() -> None:
    softer = [Hypothesis(BY_NAME["modulus"], (1, 2))]
    assert list(judged(SOFTER, softer).accepted) == softer


@pytest.mark.parametrize(
    ("has_disturbance", "expected"), [(False, {"frame", "hanging_load", "stiffening"}), (True, {"frame", "stiffening"})]
)
def test_unlisted_effects_that_were_searched_for_are_not_tried_again(has_disturbance: bool, expected: set[str]) -> None:
    robot, softer = example("three"), Hypothesis(BY_NAME["modulus"], (1, 2))
    searched = hypotheses(robot, has_disturbance)
    alternatives = list(confusable_models._unlisted_alternatives(robot, [softer], searched, is_adequate=False))
    assert {chosen[-1].effect.name for chosen in alternatives} == expected
    # Frames of the two cables and of all, stiffening of the two; each in place of the softer ropes, and beside them.
    assert len(alternatives) == 2 * 3 + (0 if has_disturbance else 2 * 2)


@pytest.mark.validate
def test_softer_ropes_with_damping_make_room_for_the_frame_that_they_stood_for() -> None:
    both = [Hypothesis(BY_NAME[name], (1, 2, 3)) for name in ("modulus", "damping")]
    found = judged(FRAME, both)
    assert [hypothesis.effect.name for hypothesis in found.accepted] == ["frame"]
    assert found.fit.values[0] == pytest.approx(1.0 / 3e6, rel=0.03)
    assert found.evidence[0] > 1000.0
    assert found.confusable == ()


@pytest.mark.validate
@pytest.mark.parametrize(("hidden", "expected"), [(SOFT_FRAME, "frame"), (ALL_SOFTER, "modulus")])
def test_beside_a_disturbance_a_frame_takes_the_place_of_softer_ropes_only_where_it_is_one(
    hidden: dict[str, Any], expected: str
) -> None:
    found = judged(hidden, [Hypothesis(BY_NAME["modulus"], (1, 2, 3))], beside_disturbance=True)
    assert [hypothesis.effect.name for hypothesis in found.accepted] == [expected]
    if expected == "frame":
        assert found.fit.values[0] == pytest.approx(1.0 / 5e5, rel=0.03)
        assert found.evidence[0] > 1000.0
        assert [(each.name, each.accepted, each.mean_square < 1.2) for each in found.candidates] == [
            ("frame", True, True)
        ]


@pytest.mark.validate
def test_a_frame_without_which_nothing_can_be_run_has_evidence_beyond_measure(monkeypatch: pytest.MonkeyPatch) -> None:
    as_it_is = Fitter.judged

    def unheld(fitter: Fitter, robot: Robot, chosen: Collection[Hypothesis], sample: DataSet) -> Innovations:
        if not chosen:
            raise UnreachableError("here", robot.platform.start, None, None)
        return as_it_is(fitter, robot, chosen, sample)

    monkeypatch.setattr(Fitter, "judged", unheld)
    found = judged(FRAME, [Hypothesis(BY_NAME[name], (1, 2, 3)) for name in ("modulus", "damping")])
    assert [hypothesis.effect.name for hypothesis in found.accepted] == ["frame"]
    assert found.evidence == (inf,)


@pytest.mark.validate
def test_a_frame_that_gives_way_is_discovered_and_not_named_after_a_rope() -> None:
    found = trace(example("three"), recorded("three", 9, FRAME), recorded("three", 59, FRAME), lambda what, done: None)
    assert found.verdict == "discovered"
    assert found.effects == ()
    assert found.formula is not None
    assert found.formula.startswith("frame: compliance = 3.")
    assert found.robot_after.effects[0].values["compliance"] == pytest.approx(1.0 / 3e6, rel=0.03)
    assert all(c.errors_after.tension_rms < 1.2 * found.noise_floor.tension_rms for c in found.comparisons)
