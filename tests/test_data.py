"""Which samples fit, which judge, and by which hypotheses are ranked."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.recording import Recording
from tautwire.tracer.data import Sample, split
from tautwire.tracer.preparation.noise import noise_of
from tests.recordings import recorded
from tests.robots import example

ROBOT = example("three")
FIT = recorded("three", 1)
NOISE = noise_of(ROBOT, FIT)


def test_no_sample_both_fits_and_judges() -> None:
    alone = split(ROBOT, NOISE, FIT, None)
    assert alone.fit.recording is alone.judge.recording
    assert not np.any(alone.fit.rows & alone.judge.rows)
    assert "no check recording" in alone.notes[-1]
    pair = split(ROBOT, NOISE, FIT, recorded("three", 2))
    assert pair.fit.rows.all() and pair.judge.rows.all()
    assert pair.fit.recording is not pair.judge.recording


def blank(count: int) -> Recording:
    """So many samples of which nothing was measured."""
    empty = np.full((count, 3), np.nan)
    return replace(FIT, time=0.001 * np.arange(count), winch_speed=np.zeros((count, 3)), tension=empty, position=empty)


@pytest.mark.parametrize(("count", "ranked"), [(500, 500), (900, 800), (6000, 2000), (90_000, 20_000)])
def test_hypotheses_are_ranked_by_a_third_within_bounds(count: int, ranked: int) -> None:
    sample = Sample(blank(count), (0.0, 0.0, 0.0), np.ones(count, dtype=bool))
    assert np.sum(sample.head.rows) == len(sample.head.recording.time) == ranked
