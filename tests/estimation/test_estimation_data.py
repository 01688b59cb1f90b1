"""Which samples fit, which judge, and by which hypotheses are ranked."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.estimation_data import DataSet, split_data
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import Recording
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
FIT = recorded("three", 1)
NOISE = estimate_noise(ROBOT, FIT)


def test_no_sample_both_fits_and_judges() -> None:
    alone = split_data(ROBOT, NOISE, FIT, None)
    assert alone.estimation.recording is alone.validation.recording
    assert not np.any(alone.estimation.rows & alone.validation.rows)
    assert "no check recording" in alone.notes[-1]
    pair = split_data(ROBOT, NOISE, FIT, recorded("three", 2))
    assert pair.estimation.rows.all() and pair.validation.rows.all()
    assert pair.estimation.recording is not pair.validation.recording


def blank(count: int) -> Recording:
    """So many samples of which nothing was measured."""
    empty = np.full((count, 3), np.nan)
    return replace(FIT, time=0.001 * np.arange(count), winch_speed=np.zeros((count, 3)), tension=empty, position=empty)


@pytest.mark.parametrize(("count", "ranked"), [(500, 500), (900, 800), (6000, 2000), (90_000, 20_000)])
def test_hypotheses_are_ranked_by_a_third_within_bounds(count: int, ranked: int) -> None:
    sample = DataSet(blank(count), (0.0, 0.0, 0.0), np.ones(count, dtype=bool))
    assert np.sum(sample.head().rows) == len(sample.head().recording.time) == ranked
