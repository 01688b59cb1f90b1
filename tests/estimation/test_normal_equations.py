"""A few rows in the place of all: the same cost, gradient and curvature."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.estimation_data import DataSet
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.normal_equations import compressed_residuals
from tautwire.robot.schema import EffectSetting
from tautwire.robot.symbolic_model import FreeParameter
from tests.support.recordings import recorded
from tests.support.robots import example

RECORDING = recorded("three", 1, gap=(6.0, 6.8))
VALUES = np.array([9e8, 2.0, 0.05])
ROWS = np.arange(len(RECORDING.time)) % 3 > 0


def likelihood() -> Likelihood:
    robot = example("three")
    robot = robot.with_effect(EffectSetting("damping", {"damping": 9e8}, (1, 2, 3)))
    robot = robot.with_effect(EffectSetting("payload", {"mass": 2.0}))
    robot = robot.with_effect(EffectSetting("sensor_delay", {"tension_delay": 0.05, "position_delay": 0.0}, (1, 2, 3)))
    free = [FreeParameter(0, "damping"), FreeParameter(1, "mass"), FreeParameter(2, "tension_delay")]
    return Likelihood(robot, free, estimate_noise(robot, RECORDING), 0.02)


def test_few_rows_have_the_cost_gradient_and_curvature_of_all() -> None:
    position, tension = RECORDING.position.copy(), RECORDING.tension.copy()
    position[::7, 1], tension[::5, 2] = np.nan, np.nan
    recording = replace(RECORDING, position=position, tension=tension)
    whole = likelihood()
    residuals, slopes = compressed_residuals(whole, VALUES, DataSet(recording, (0.0, 0.0, 0.0), ROWS), 0.1)
    assert residuals.shape == (4,) and slopes.shape == (4, 3)
    all_of_them = whole.innovations(recording, VALUES, 0.1)
    chosen = all_of_them.observed & ROWS[:, None]
    e, jacobian = all_of_them.values[chosen], all_of_them.sensitivities[chosen]
    assert residuals @ residuals == pytest.approx(e @ e, rel=1e-10)
    assert slopes.T @ residuals == pytest.approx(jacobian.T @ e, rel=1e-6)
    assert slopes.T @ slopes == pytest.approx(jacobian.T @ jacobian, rel=1e-8)


def test_what_is_not_finite_stays_so() -> None:
    wild = np.array([9e8, np.nan, 0.05])
    residuals, _ = compressed_residuals(likelihood(), wild, DataSet(RECORDING, (0.0, 0.0, 0.0), ROWS), 0.0)
    assert np.isnan(residuals).all()
