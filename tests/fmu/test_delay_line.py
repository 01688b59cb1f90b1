"""What a lagging sensor remembers."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tautwire_fmu.delay_line import DelayLine, SignalSample, append_segment, delayed_value

SIGNAL = np.polynomial.Polynomial([3.0, -2.0, 0.5, 4.0])


def at(time: float, count: int = 2) -> SignalSample:
    return SignalSample(time, [float(SIGNAL.deriv(k)(time)) if k else float(SIGNAL(time)) for k in range(count)])


def delay_line(times: list[float], lag: float, count: int = 2) -> DelayLine:
    past: DelayLine = ()
    for begin, end in pairwise(times):
        past = append_segment(past, at(begin, count), at(end, count), lag)
    return past


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("lag", [0.01, 0.05, 0.099, 0.23])
def test_it_shows_value_and_rate_of_some_time_ago(lag: float, count: int) -> None:
    past = delay_line(np.arange(0.0, 0.51, 0.1).tolist(), lag, count)
    assert delayed_value(past, lag) == pytest.approx((SIGNAL(0.5 - lag), SIGNAL.deriv()(0.5 - lag)), rel=1e-12)


def test_before_the_start_it_shows_the_start() -> None:
    assert delayed_value(delay_line([0.0, 0.1], 0.3), 0.3) == (3.0, 0.0)


def test_it_forgets_what_has_lagged_out() -> None:
    past = delay_line(np.arange(0.0, 10.0, 0.01).tolist(), 0.05)
    assert 5 <= len(past) <= 8
    assert delayed_value(past, 0.05) == pytest.approx((SIGNAL(9.94), SIGNAL.deriv()(9.94)), rel=1e-12)


def test_a_jump_between_pieces_stays_one() -> None:
    past = append_segment((), SignalSample(0.0, (1.0, 0.0)), SignalSample(0.1, (1.0, 0.0)), 0.2)
    past = append_segment(past, SignalSample(0.1, (5.0, 0.0)), SignalSample(0.2, (5.0, 0.0)), 0.2)
    assert delayed_value(past, 0.05)[0] == 5.0
    assert delayed_value(past, 0.15)[0] == 1.0
