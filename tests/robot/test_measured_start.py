"""Where a run starts, by a position sensor with errors of its own."""

import casadi
import numpy as np
import pytest

from tautwire.recordings.start_position import start_position
from tautwire.robot.measured_start import shown_position, with_measured_start, with_true_start
from tautwire.robot.schema import EffectSetting
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.symbolic_model import FreeParameter, symbolic_model
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
OFFSETS = {"position_offset_x": 0.2, "position_offset_y": -0.3, "position_offset_z": 0.4}
OFF = ROBOT.with_effect(EffectSetting("sensor_offset", OFFSETS, (1, 2, 3))).with_effect(
    EffectSetting("sensor_gain", {"position_gain": 1.25}, (1, 2, 3))
)


def test_a_measured_start_without_the_sensors_errors_is_the_true_one() -> None:
    shown = shown_position(OFF, (10.0, 4.0, 6.0))
    assert shown == pytest.approx((12.7, 4.7, 7.9))
    x, y, z = shown
    assert with_true_start(with_measured_start(OFF, (x, y, z))).platform.start == pytest.approx((10.0, 4.0, 6.0))


def test_an_axis_that_starts_as_declared_is_true_as_it_is() -> None:
    x, y, z = ROBOT.platform.start
    placed = with_measured_start(OFF, (x, y, z + 1.0))
    assert placed.start_is_measured == (False, False, True)
    assert with_true_start(placed).platform.start == pytest.approx((x, y, (z + 0.6) / 1.25))
    assert with_true_start(with_measured_start(OFF, ROBOT.platform.start)) == OFF


def test_a_declared_offset_is_no_other_start() -> None:
    hidden = {"sensor_offset": {"place": list(OFFSETS.values())}}
    recording = recorded("three", 1, hidden)
    offset = ROBOT.with_effect(EffectSetting("sensor_offset", OFFSETS, (1, 2, 3)))
    assert start_position(offset, 3e-4, recording) == (ROBOT.platform.start, ())
    assert start_position(ROBOT, 3e-4, recording)[0] == pytest.approx(
        shown_position(offset, ROBOT.platform.start), abs=1e-3
    )


def test_the_model_starts_where_a_free_offset_says() -> None:
    start = (29.0, 0.5, 6.0)
    offset = with_measured_start(ROBOT.with_effect(EffectSetting("sensor_offset", OFFSETS, (1, 2, 3))), start)
    free = [FreeParameter(0, name) for name in OFFSETS]
    model = symbolic_model(offset, free)
    found = casadi.Function("start", [model.parameters], [model.start])
    at = np.array(found([0.1, -0.2, 0.3])).ravel()
    elsewhere = with_true_start(with_measured_start(ROBOT, (28.9, 0.7, 5.7)))
    expected = symbolic_model(elsewhere)
    assert at == pytest.approx(np.array(casadi.Function("start", [], [expected.start])()["o0"]).ravel(), rel=1e-14)
    tensions = casadi.Function("tensions", [model.states, model.inputs, model.parameters], [model.span_tensions])
    at_rest = np.array(tensions(at, np.zeros(6), [0.1, -0.2, 0.3])).ravel()
    assert at_rest == pytest.approx(static_tensions(elsewhere), rel=1e-12)
