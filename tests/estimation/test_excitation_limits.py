"""Limits of an excitation: the robot file's, or shares of what the robot has."""

from __future__ import annotations

import pytest

from tautwire.errors import InputError
from tautwire.estimation.excitation_limits import default_limits
from tests.support.rigid_robots import suspended_robot
from tests.support.robots import example

THREE = example("three")


def test_limits_not_given_come_from_the_robot() -> None:
    limits = default_limits(THREE)
    assert limits.speed == 0.5
    assert 0.0 < limits.min_tension < limits.max_tension
    assert default_limits(THREE, 0.2, 0.1).reach == 0.1
    eight = example("eight")
    assert eight.tension is not None
    assert default_limits(eight).min_tension == eight.tension.minimum


def test_a_platform_on_fewer_cables_is_refused() -> None:
    with pytest.raises(InputError, match="suspended: has a platform on 4 cables, whose orientation statics decides"):
        default_limits(suspended_robot(4))
