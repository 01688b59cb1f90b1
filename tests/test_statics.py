from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from tautwire.errors import UnreachableError
from tautwire.robot import EffectSetting, TensionLimits
from tautwire.statics import directions, static_tensions
from tests.robots import NAMES, example, paper_robot


@pytest.mark.parametrize("name", NAMES)
def test_tensions_hold_the_weight(name: str) -> None:
    robot = example(name)
    held = directions(robot) @ static_tensions(robot)
    assert held == pytest.approx([0.0, 0.0, robot.platform.mass * robot.gravity], abs=1e-8)


def test_the_papers_start_tension() -> None:
    assert static_tensions(paper_robot()) == pytest.approx([1594.1] * 3, abs=0.3)


def test_a_payload_is_held_too() -> None:
    robot = paper_robot().with_effect(EffectSetting("payload", {"mass": 30.0}))
    assert static_tensions(robot) == pytest.approx(1.1 * static_tensions(paper_robot()), rel=1e-12)


@pytest.mark.parametrize(("minimum", "maximum", "preferred"), [(10.0, 5000.0, 900.0), (600.0, 1100.0, 700.0)])
def test_more_cables_stay_as_near_to_the_preferred_tension_as_limits_allow(
    minimum: float, maximum: float, preferred: float
) -> None:
    robot = replace(example("eight"), tension=TensionLimits(minimum, maximum, preferred))
    tensions = static_tensions(robot)
    assert np.all(tensions >= minimum - 1e-9)
    assert np.all(tensions <= maximum + 1e-9)
    unit, load = directions(robot), np.array([0.0, 0.0, robot.platform.mass * robot.gravity])
    other = minimize(
        lambda t: float(np.sum((t - preferred) ** 2)),
        np.full(8, preferred),
        bounds=[(minimum, maximum)] * 8,
        constraints={"type": "eq", "fun": lambda t: unit @ t - load},
        options={"ftol": 1e-12, "maxiter": 500},
    )
    assert np.sum((tensions - preferred) ** 2) == pytest.approx(other.fun, rel=1e-6)


def test_the_cable_that_would_push_is_named() -> None:
    with pytest.raises(UnreachableError) as caught:
        static_tensions(paper_robot(), np.array([-20.0, 0.0, 5.0]))
    assert caught.value.cable == 3
    assert caught.value.tension is not None and caught.value.tension < 0.0
    assert "cable 3 would need -" in str(caught.value)


def test_cables_in_one_plane_hold_nothing() -> None:
    with pytest.raises(UnreachableError, match="in one plane"):
        static_tensions(paper_robot(), np.array([28.86, 0.0, 50.0]))


def test_limits_that_no_distribution_meets_are_refused() -> None:
    robot = replace(example("eight"), tension=TensionLimits(1.0, 20.0, 10.0))
    with pytest.raises(UnreachableError, match="between 1 and 20 N"):
        static_tensions(robot)
