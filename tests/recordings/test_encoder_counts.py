"""Counts are told by steps and range; the coordinates tell cable and scale of a column, or nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire import read_robot
from tautwire.recordings.encoder_counts import are_counts, rope_scales
from tests.support.robots import EXAMPLES

ROBOT = read_robot(EXAMPLES / "three" / "robot.toml")
PHASE = np.linspace(0.0, 9.0, 500)


def position() -> NDArray[np.float64]:
    return np.array(ROBOT.platform.start) + np.column_stack([np.sin(PHASE), np.cos(1.7 * PHASE), np.sin(2.9 * PHASE)])


def by_coordinates(places: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(np.array(ROBOT.anchors) - places[:, None], axis=2))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (np.round(20_000 * np.sin(PHASE)), True),
        (np.append(np.round(20_000 * np.sin(PHASE)), np.nan), True),
        (20_000 * np.sin(PHASE), False),
        (np.round(2_000 * np.sin(PHASE)), False),
        (100.0 * np.arange(500), False),
        (np.where(PHASE > 4.0, 20_000.0, 0.0), False),
        (np.round(20_000 * np.random.default_rng(1).random(500)), False),
    ],
    ids=["counts", "a gap", "not whole", "narrow", "even steps", "two values", "jumps"],
)
def test_counts_are_whole_and_change_by_small_steps(values: NDArray[np.float64], expected: bool) -> None:
    assert are_counts(values) is expected


def test_coordinates_tell_cable_and_scale_of_counts_where_they_were_measured() -> None:
    places = position()
    lengths = by_coordinates(places)
    places[::3] = np.nan
    counts = [np.round(lengths[:, cable] / scale) + 7e5 for cable, scale in ((2, 1e-5), (0, -2e-5), (1, 3e-5))]
    told = rope_scales(by_coordinates(places), [*counts, np.sin(40.0 * PHASE)])
    assert told is not None
    assert told.cables.tolist() == [2, 0, 1, -1]
    assert told.scales[:3] == pytest.approx([1e-5, -2e-5, 3e-5], rel=1e-4)
    assert np.isnan(told.scales[3]) and np.nanmax(told.misfits) < 1e-8


def test_a_scale_of_a_known_cable_is_told_where_that_fits() -> None:
    places = position()
    lengths = by_coordinates(places)
    told = rope_scales(by_coordinates(places), [lengths[:, 1] / 2e-5], [1])
    assert told is not None and told.scales == pytest.approx([2e-5])
    assert rope_scales(by_coordinates(places), [lengths[:, 1] / 2e-5], [2]) is None


@pytest.mark.parametrize(
    "case", ["one cable twice", "two columns of one cable", "too few", "standing", "other motion", "no positions"]
)
def test_counts_that_the_coordinates_do_not_tell_have_no_cables(case: str) -> None:
    places = position()
    lengths = by_coordinates(places) / 1e-5
    counts = {
        "one cable twice": [lengths[:, 0], lengths[:, 0], lengths[:, 2]],
        "two columns of one cable": [*lengths.T, 0.5 * lengths[:, 1]],
        "too few": [lengths[:, 0], lengths[:, 1]],
        "standing": [np.zeros(500), lengths[:, 1], lengths[:, 2]],
        "other motion": [lengths[::-1, cable] for cable in range(3)],
        "no positions": list(lengths.T),
    }[case]
    places = np.full_like(places, np.nan) if case == "no positions" else places
    assert rope_scales(by_coordinates(places), counts) is None
