import numpy as np
import pytest

from tautwire.errors import InputError, UnreachableError
from tautwire.linear import linearise, modes_along
from tautwire.robot.schema import Cable, Platform, Robot, Sensors, TensionLimits
from tautwire.robot.trajectory import PAPER_HELIX, Line
from tests.support.robots import example, paper_robot


def block() -> Robot:
    """Eight cables in a box, on whose axes each mode is along an axis: frequencies cross, shapes do not change."""
    anchors = tuple((x, y, z) for z in (-4.0, 4.0) for x in (-4.0, 4.0) for y in (-3.0, 3.0))
    cables = tuple(Cable(anchor, 1e9, 1e-5, 0.0, "logarithmic") for anchor in anchors)
    limits = TensionLimits(minimum=1.0, maximum=1e5, preferred=50.0)
    return Robot("block", 0.0, Platform(50.0, (0.0, 0.0, 0.0)), limits, Sensors(), cables)


def test_modes_keep_their_shapes_where_frequencies_cross() -> None:
    along = modes_along(block(), Line((0.0, 0.0, 0.0), (3.5, 0.0, 0.0), 10.0), points=11)
    assert not np.array_equal(np.argsort(along.frequencies[-1]), np.argsort(along.frequencies[0]))
    axes = np.argmax(np.abs(along.shapes), axis=1)
    assert np.all(axes == axes[1])
    assert along.modal_assurance[1:].min() > 0.999


def test_frequencies_at_each_place_are_those_of_the_plant_there() -> None:
    robot = example("caroca")
    path = Line((1.0, 0.0, 1.0), (0.0, -0.5, 2.0), 4.0)
    along = modes_along(robot, path, times=np.array([0.0, 1.0, 4.0]))
    assert along.abscissa.tolist() == [0.0, 1.0, 4.0] and along.is_timed
    for place, frequencies, ratios in zip(along.positions, along.frequencies, along.damping_ratios, strict=True):
        modes = linearise(robot, place).modes
        order = np.argsort(frequencies)
        assert frequencies[order] == pytest.approx(modes.frequencies, rel=1e-12)
        assert ratios[order] == pytest.approx(modes.damping_ratios, rel=1e-9)


@pytest.mark.validate
def test_a_coarse_path_finds_the_same_modes_as_a_fine_one() -> None:
    # The helix turns twice: between coarse places modes cross, and shapes turn by more than half a right angle.
    fine, coarse = (modes_along(paper_robot(damping=4e8), PAPER_HELIX, points=points) for points in (81, 17))
    assert coarse.frequencies == pytest.approx(fine.frequencies[::5], rel=1e-12)
    assert coarse.modal_assurance.min() < 0.6


@pytest.mark.validate
def test_modes_that_come_near_cross_however_finely_the_path_is_cut() -> None:
    # The two upper modes miss each other by 0.03 %, and turn into each other within a few centimetres.
    path = Line((28.86, 0.0, 5.0), (20.3, 0.23, 8.5), 7.0)
    robot = paper_robot(damping=4e8, modulus=102.2e9)
    fine, coarse = (modes_along(robot, path, points=points) for points in (161, 9))
    assert np.argsort(fine.frequencies[-1]).tolist() == [0, 2, 1]
    assert coarse.frequencies == pytest.approx(fine.frequencies[::20], rel=1e-12)
    assert np.all(np.abs(fine.shapes[:, 1, 1]) > 0.9)
    for frequencies, place in zip(fine.frequencies, fine.positions, strict=True):
        assert np.sort(frequencies) == pytest.approx(linearise(robot, place, swing=0.0).modes.frequencies, rel=1e-12)


def test_modes_of_one_frequency_are_turned_towards_the_next() -> None:
    anchors = tuple((4.0 * np.cos(a), 4.0 * np.sin(a), 3.0) for a in 2.0 * np.pi * np.arange(3) / 3.0)
    cables = tuple(Cable(anchor, 1e9, 1e-5, 0.0, "logarithmic") for anchor in anchors)
    robot = Robot("even", 9.8, Platform(50.0, (0.0, 0.0, 0.0)), None, Sensors(), cables)
    along = modes_along(robot, np.array([[0.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.4, 0.0]]))
    assert along.frequencies[0, 1] == pytest.approx(along.frequencies[0, 0], rel=1e-9)
    assert along.modal_assurance.min() > 0.99
    assert along.cable_shares.sum(axis=1) == pytest.approx(np.ones((3, 3)))
    # The shares follow the turned shapes: symmetric about the path, as the second cable mirrors the third.
    across = int(np.argmax(np.abs(along.shapes[0][0])))
    assert along.cable_shares[0, 0, across] == pytest.approx(along.cable_shares[1, 0, across], rel=0.1)


def test_positions_without_times_count_the_way() -> None:
    along = modes_along(paper_robot(), np.array([[28.86, 0.0, 5.0], [28.86, 3.0, 9.0], [28.86, 3.0, 10.0]]))
    assert along.abscissa == pytest.approx([0.0, 5.0, 6.0]) and not along.is_timed
    assert along.shapes.shape == (3, 3, 3) and along.cable_shares.shape == (3, 3, 3)


def test_the_papers_ratio_of_dynamic_to_quasi_static_frequencies() -> None:
    path = Line((28.86, 0.0, 5.0), (20.3, 0.23, 8.5), 7.0)
    slow, fast = (modes_along(paper_robot(modulus=modulus), path, points=3) for modulus in (102.2e9, 134.8e9))
    assert fast.frequencies / slow.frequencies == pytest.approx(np.full((3, 3), np.sqrt(134.8 / 102.2)), rel=1e-3)


@pytest.mark.parametrize(
    ("path", "times", "message"),
    [
        (np.zeros((4, 2)), None, "shape"),
        (np.array([[28.0, 0.0, 5.0]]), None, "two or more"),
        (np.array([[28.0, 0.0, 5.0], [29.0, 0.0, 5.0]]), np.arange(3.0), "one time for each"),
        (np.array([[28.0, 0.0, 5.0], [np.nan, 0.0, 5.0]]), None, "finite"),
    ],
)
def test_a_path_that_is_none_is_refused(path: np.ndarray, times: np.ndarray | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        modes_along(paper_robot(), path, times)


def test_a_path_out_of_the_workspace_is_refused() -> None:
    with pytest.raises(UnreachableError, match="cable 3 would need"):
        modes_along(paper_robot(), Line((28.86, 0.0, 5.0), (-20.0, 0.0, 5.0), 5.0), points=4)
