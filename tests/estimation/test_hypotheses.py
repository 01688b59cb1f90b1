"""Which effects a trace tries on which robot."""

from __future__ import annotations

import pytest

from tautwire.estimation.hypotheses import Hypothesis, hypotheses, searched_hypotheses, with_larger_forms
from tautwire.robot.schema import Robot
from tautwire_fmu.laws.effects import ALL, BY_NAME
from tests.support.rigid_robots import crane_robot
from tests.support.robots import example

OF_RIGID_BODIES = {"centre_of_mass", "attachment", "inertia", "rotational_drag", "transverse_damping"}


def names(robot: Robot) -> set[str]:
    return {hypothesis.effect.name for hypothesis in hypotheses(robot)}


def test_effects_of_rigid_bodies_are_tried_on_them_alone() -> None:
    assert names(crane_robot()) == {effect.name for effect in ALL}
    assert names(crane_robot()) - names(example("eight")) == OF_RIGID_BODIES


@pytest.mark.parametrize("robot", [crane_robot(), example("eight")])
def test_hanging_loads_and_stiffening_are_tried_beside_a_disturbance_only(robot: Robot) -> None:
    beside = hypotheses(robot, has_disturbance=True)
    unlisted = {Hypothesis(BY_NAME["hanging_load"], ()), Hypothesis(BY_NAME["stiffening"], robot.cable_numbers)}
    assert set(beside) - set(hypotheses(robot)) == unlisted
    assert len(beside) == len(hypotheses(robot)) + 2


def test_an_attachment_is_tried_of_one_cable_at_a_time() -> None:
    cables = [hypothesis.cables for hypothesis in hypotheses(crane_robot()) if hypothesis.effect.name == "attachment"]
    assert cables == [(number,) for number in range(1, 9)]


@pytest.mark.parametrize(("robot", "forms"), [(crane_robot(), [("mass", "x", "y", "z")]), (example("eight"), [])])
def test_a_payload_has_a_place_on_a_rigid_body_only(robot: Robot, forms: list[tuple[str, ...]]) -> None:
    larger = with_larger_forms([Hypothesis(BY_NAME["payload"], ())], robot)
    assert [hypothesis.form for hypothesis in larger] == forms


@pytest.mark.parametrize("has_disturbance", [False, True])
def test_a_search_tries_a_payload_beside_the_centre_of_mass_too(has_disturbance: bool) -> None:
    aside = Hypothesis(BY_NAME["payload"], (), ("mass", "x", "y", "z"))
    for robot, more in ((crane_robot(), (aside,)), (example("eight"), ())):
        assert searched_hypotheses(robot, has_disturbance) == (*hypotheses(robot, has_disturbance), *more)
