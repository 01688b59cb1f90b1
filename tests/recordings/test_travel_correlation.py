"""Travel is known where samples are; one candidate is taken of each valley of misfits."""

from __future__ import annotations

import numpy as np

from tautwire.recordings.travel_correlation import TRAVEL_WINDOW, lowest_valleys, travel_on_grid


def test_the_lowest_point_of_each_valley_is_a_candidate_once() -> None:
    misfits = np.array([0.9, 0.2, 0.1, 0.3, 0.8, 0.7, 0.05, 0.6, 0.9])
    assert lowest_valleys(misfits, 0.5, 1) == [6, 2]
    assert lowest_valleys(misfits, 0.08, 1) == [6]
    assert misfits[6] == 0.05


def test_travel_over_a_gap_is_not_known() -> None:
    times = np.concatenate([np.arange(0.0, 2.0, 0.01), np.arange(3.0, 5.0, 0.01)])
    travel, known = travel_on_grid(times, 0.5 * times[:, None], 0.02)
    inside = known > 0.0
    np.testing.assert_allclose(travel[inside], 0.5 * TRAVEL_WINDOW, rtol=1e-9)
    assert not travel[~inside].any() and 0.2 < 1.0 - inside.mean() < 0.4
