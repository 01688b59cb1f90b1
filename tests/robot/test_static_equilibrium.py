from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from tautwire.errors import UnreachableError
from tautwire.robot.cable_routes import unit_directions
from tautwire.robot.schema import EffectSetting, TensionLimits
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.robots import NAMES, example, paper_robot


@pytest.mark.parametrize("name", NAMES)
def test_tensions_hold_the_weight(name: str) -> None:
    robot = example(name)
    held = unit_directions(robot) @ static_tensions(robot)
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
    unit, load = unit_directions(robot), np.array([0.0, 0.0, robot.platform.mass * robot.gravity])
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


def test_the_cable_that_would_push_is_named_among_more_than_three() -> None:
    # Without limits, beyond the wall two of the eight would have to push, the nearer upper corners most.
    robot = replace(example("eight"), tension=None)
    with pytest.raises(UnreachableError) as caught:
        static_tensions(robot, np.array([11.0, 3.0, 2.5]))
    error = caught.value
    assert error.cable is not None and error.tension is not None and error.tension < 0.0
    assert f"cable {error.cable} would need {error.tension:.6g} N" in str(error)
    # With that push allowed to this cable and as much to the others, the platform is held.
    relaxed = replace(robot, tension=TensionLimits(error.tension, 1e9, 0.0))
    assert static_tensions(relaxed, np.array([11.0, 3.0, 2.5])).min() >= error.tension - 1e-6


def test_the_cable_that_breaks_its_limit_most_is_named_with_what_it_would_need() -> None:
    robot = replace(example("eight"), tension=TensionLimits(1.0, 120.0, 10.0))
    with pytest.raises(UnreachableError, match="between 1 and 120 N") as caught:
        static_tensions(robot, np.array([5.0, 3.0, 4.0]))
    assert caught.value.tension is not None and not 1.0 <= caught.value.tension <= 120.0
    wide = replace(robot, tension=TensionLimits(-abs(caught.value.tension), 120.0 + abs(caught.value.tension), 10.0))
    assert static_tensions(wide, np.array([5.0, 3.0, 4.0])).min() < 1.0


def test_more_cables_in_one_plane_hold_nothing() -> None:
    robot = replace(example("eight"), tension=None)
    flat = replace(robot, cables=tuple(c for c in robot.cables if c.anchor[2] == 6.0))
    with pytest.raises(UnreachableError, match="the 4 cables lie in one plane there"):
        static_tensions(flat, np.array([5.0, 4.0, 6.0]))


@pytest.mark.parametrize("turn", (0.0, 0.25 * np.pi, 0.5 * np.pi, 2.0))
@pytest.mark.parametrize("count", (2, 3, 4))
def test_cables_in_an_upright_plane_hold_what_hangs_in_it(count: int, turn: float) -> None:
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    points = [(-1.5, 3.0), (2.0, 3.0), (0.2, 0.0), (1.0, 3.5)][:count]
    anchors = [tuple((s * along + [0.0, 0.0, z]).tolist()) for s, z in points]
    three = example("three")
    cables = tuple(replace(three.cables[0], anchor=anchor) for anchor in anchors)
    limits = TensionLimits(1.0, 1e5, 500.0) if count > 2 else None
    robot = replace(three, cables=cables, tension=limits)
    place = 0.3 * along + np.array([0.0, 0.0, 1.5])
    tensions = static_tensions(robot, place)
    spans = np.array(anchors) - place
    force = tensions @ (spans / np.linalg.norm(spans, axis=1)[:, None])
    assert force == pytest.approx([0.0, 0.0, robot.platform.mass * robot.gravity], abs=1e-3)
    assert tensions.min() >= (0.0 if limits is None else 1.0 - 1e-6)


@pytest.mark.parametrize("tension", [None, TensionLimits(100.0, 4000.0, 600.0), TensionLimits(300.0, 1000.0, 400.0)])
def test_tensions_are_continuous_along_a_path(tension: TensionLimits | None) -> None:
    robot = replace(example("eight"), tension=tension)
    begin, end = np.array([3.0, 2.0, 1.5]), np.array([6.0, 5.0, 3.0])

    def jump(count: int) -> float:
        places = begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin)
        tensions = np.array([static_tensions(robot, place) for place in places])
        if tension is not None and count > 300:
            # Cables meet their limits on the way, and leave them again.
            held = np.isclose(tensions, tension.minimum) | np.isclose(tensions, tension.maximum)
            assert tension.minimum == 100.0 or (held.any() and not held.all())
        return float(np.max(np.abs(np.diff(tensions, axis=0))))

    assert jump(801) == pytest.approx(jump(201) / 4.0, rel=0.1)
