from dataclasses import replace

import numpy as np

from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.preprocessing import detectable_length
from tautwire.recordings.gaps import without_gaps
from tautwire.recordings.recording import Recording
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT, WHOLE = example("three"), recorded("three", 1)
DETECTABLE = detectable_length(ROBOT, estimate_noise(ROBOT, WHOLE), WHOLE)


def without(recording: Recording, lost: slice) -> Recording:
    def rows(columns: np.ndarray) -> np.ndarray:
        return np.delete(columns, lost, axis=0)

    return replace(
        recording,
        time=rows(recording.time),
        winch_speed=rows(recording.winch_speed),
        tension=rows(recording.tension),
        position=rows(recording.position),
    )


def test_a_recording_without_gaps_stays() -> None:
    assert without_gaps(WHOLE, DETECTABLE) == (WHOLE, ())


def test_the_longest_part_between_gaps_is_used() -> None:
    gapped = without(without(WHOLE, slice(650, 700)), slice(200, 250))
    part, notes = without_gaps(gapped, DETECTABLE)
    assert (part.time[0], part.time[-1]) == (WHOLE.time[250], WHOLE.time[649])
    assert np.array_equal(part.tension, WHOLE.tension[250:650])
    assert "three-1.csv: the winch motion in its gaps (at 3.98 s, 12.98 s) is unknown" in notes[0]


def test_a_gap_in_which_winches_rest_is_none() -> None:
    resting = replace(WHOLE, winch_speed=np.zeros_like(WHOLE.winch_speed))
    gapped = without(resting, slice(200, 250))
    assert without_gaps(gapped, DETECTABLE) == (gapped, ())


def test_a_few_lost_samples_part_nothing_where_winches_move_slowly() -> None:
    slow = replace(WHOLE, winch_speed=np.cumsum(np.full_like(WHOLE.winch_speed, 1e-4), axis=0))
    gapped = without(slow, slice(300, 303))
    assert without_gaps(gapped, DETECTABLE) == (gapped, ())
