import numpy as np

from tautwire.tracer.data import split
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
