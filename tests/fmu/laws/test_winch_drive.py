"""The winch's drive: a speed loop within limits."""

import math

import control
import numpy as np
import pytest

from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, rate_of, with_rate
from tautwire_fmu.laws.winch_drive import NO_LIMIT, DriveConstants, DriveState, acceleration, limit_margins, state_rates

FREE = DriveConstants(frequency=40.0, damping_ratio=0.6, speed_limit=NO_LIMIT, acceleration_limit=NO_LIMIT)
LIMITED = FREE._replace(speed_limit=0.8, acceleration_limit=2.0)
REST = DriveState(0.0, 0.0)


def slopes(state: DriveState, command: complex) -> list[float]:
    """The rates that carried rates give."""
    return [rate_of(value) for value in state_rates(COMPLEX_STEP, FREE, state, command)]


def test_without_limits_it_is_the_transfer_function_of_a_proportional_integral_loop() -> None:
    A = np.array([slopes(DriveState(with_rate(0.0, v), with_rate(0.0, z)), 0.0) for v, z in ((1.0, 0.0), (0.0, 1.0))]).T
    B = np.array([slopes(DriveState(0.0, 0.0), with_rate(0.0, 1.0))]).T
    result = control.ss(A, B, [[1.0, 0.0]], 0.0)
    expected = control.tf([2.0 * 0.6 * 40.0, 40.0**2], [1.0, 2.0 * 0.6 * 40.0, 40.0**2])
    frequencies = np.array([0.3, 5.0, 40.0, 300.0])
    assert result(1j * frequencies) == pytest.approx(expected(1j * frequencies), rel=1e-12)


def test_it_stays_where_it_is_asked_to_be() -> None:
    assert state_rates(REAL, LIMITED, DriveState(0.5, 0.0), 0.5) == (0.0, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_acceleration_is_limited_both_ways_and_the_integral_follows_what_was_possible(sign: float) -> None:
    rates = state_rates(REAL, LIMITED, REST, 0.8 * sign)
    assert rates.speed == 2.0 * sign
    assert rates.integral == pytest.approx(2.0 * sign * 40.0 / 1.2)
    assert state_rates(REAL, LIMITED, DriveState(0.0, 2.0 * sign), 0.8 * sign).integral == 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_its_limit_the_speed_grows_no_more(sign: float) -> None:
    assert acceleration(REAL, LIMITED, DriveState(0.8 * sign, 1.5 * sign), 5.0 * sign) == pytest.approx(0.0, abs=1e-15)
    assert acceleration(REAL, LIMITED, DriveState(0.8 * sign, 1.5 * sign), 0.0) * sign < 0.0


def test_a_command_beyond_the_limit_is_one_at_the_limit() -> None:
    state = DriveState(0.3, 0.1)
    assert acceleration(REAL, LIMITED, state, 50.0) == acceleration(REAL, LIMITED, state, 0.8)


def slope(state: DriveState, command: float, change: float) -> float:
    """How the acceleration changes with the command."""
    return (acceleration(REAL, LIMITED, state, command + change) - acceleration(REAL, LIMITED, state, command)) / change


def test_event_indicators_change_their_sign_where_the_law_has_a_kink() -> None:
    state = DriveState(0.79, 0.0)
    assert slope(state, 0.8, 1e-6) == 0.0
    assert slope(state, 0.8, -1e-6) == pytest.approx(48.0)
    assert [limit_margins(REAL, LIMITED, state, 0.8 + change)[0] > 0.0 for change in (1e-6, -1e-6)] == [False, True]
    corner = 2.0 / 48.0
    assert slope(REST, corner, 1e-6) == 0.0
    assert slope(REST, corner, -1e-6) == pytest.approx(48.0)
    assert [limit_margins(REAL, LIMITED, REST, corner + change)[1] > 0.0 for change in (1e-6, -1e-6)] == [False, True]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_last_margin_tells_which_limit_bounds_the_acceleration(sign: float) -> None:
    corner = 0.8 - 2.0 / 48.0
    before, after = (DriveState(sign * (corner + change), 5.0 * sign) for change in (-1e-6, 1e-6))
    assert acceleration(REAL, LIMITED, before, 1.0 * sign) == 2.0 * sign
    assert abs(acceleration(REAL, LIMITED, after, 1.0 * sign)) < 2.0
    assert limit_margins(REAL, LIMITED, before, 1.0)[2] > 0.0 > limit_margins(REAL, LIMITED, after, 1.0)[2]


def test_rates_pass_through_it() -> None:
    carried = acceleration(
        COMPLEX_STEP, LIMITED, DriveState(with_rate(0.1, 0.0), with_rate(0.0, 0.0)), with_rate(0.11, 3.0)
    )
    assert rate_of(carried) == pytest.approx(3.0 * 48.0)
    assert math.isclose(carried.real, 0.48)
