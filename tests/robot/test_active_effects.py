"""Effects as the laws take them, by component."""

from __future__ import annotations

from tautwire.robot.active_effects import cable_effects, platform_effects
from tautwire.robot.schema import EffectSetting
from tests.support.robots import example


def test_the_filter_of_load_cells_has_its_state_in_the_cables_alone() -> None:
    filtered = EffectSetting("sensor_delay", {"tension_time_constant": 0.05, "position_delay": 0.02}, (1, 2, 3))
    robot = example("three").with_effect(filtered)
    (in_cable,) = cable_effects(robot, 1)
    (on_platform,) = platform_effects(robot)
    assert len(in_cable.effect.states) == 1
    assert in_cable.effect.low_pass is not None
    assert on_platform.effect.states == ()
    assert on_platform.effect.low_pass is None
    assert on_platform.values == in_cable.values
