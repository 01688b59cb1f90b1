"""Of recordings longer than a trace can take the beginning is traced, and that is said."""

import numpy as np
import pytest

from tautwire.estimation import preprocessing, trace
from tautwire.estimation.preprocessing import shortened
from tests.support.recordings import recorded
from tests.support.robots import example

FIT, CHECK = recorded("three", 1), recorded("three", 51)


def test_recordings_that_are_short_enough_stay() -> None:
    fit, check, notes = shortened(FIT, CHECK, FIT.sample_count)
    assert fit is FIT and check is CHECK and notes == ()


def test_each_of_two_is_cut_and_told() -> None:
    fit, check, notes = shortened(FIT, CHECK, 301)
    assert check is not None
    assert fit.sample_count == check.sample_count == 301
    np.testing.assert_array_equal(fit.position, FIT.position[:301])
    assert [note.split(":")[0] for note in notes] == [FIT.path, CHECK.path]
    assert notes[0].endswith("its first 6 s, 301 of 801 samples, were traced; to trace another part, cut it out")


def test_the_only_one_keeps_twice_as_much_since_it_judges_too() -> None:
    fit, check, notes = shortened(FIT, None, 301)
    assert fit.sample_count == 602 and check is None and len(notes) == 1
    assert shortened(FIT, None, 401)[2] == ()


@pytest.mark.validate
def test_a_trace_takes_the_beginning_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preprocessing, "shortened", lambda fit, check, _: shortened(fit, check, 300))
    found = trace(example("three"), FIT, CHECK)
    assert found.verdict == "none"
    assert [c.recording.sample_count for c in found.comparisons] == [300, 300]
    assert sum("were traced" in note for note in found.notes) == 2
