from dataclasses import replace

import numpy as np
import pytest

from tautwire.linear import OperatingPointError, linearise
from tautwire.robot.schema import Cable, EffectSetting, Formula, Platform, Robot, Sensors
from tests.support.robots import example, paper_robot, with_damping

# Straight below the line between two exit points the third cable has nothing to carry.
BELOW = (0.0, 0.0, 0.0)


def third_slack() -> Robot:
    anchors = ((-4.0, 0.0, 3.0), (4.0, 0.0, 3.0), (0.0, 4.0, 3.0))
    cables = tuple(Cable(anchor, 1e9, 1e-5, 2e6, "logarithmic") for anchor in anchors)
    return Robot("third", 9.8, Platform(50.0, (0.0, 1.0, 0.0)), None, Sensors(), cables)


def with_effect(robot: Robot, name: str, **values: float) -> Robot:
    return robot.with_effect(EffectSetting(name, values, robot.cable_numbers))


def test_a_smooth_robot_has_no_notes() -> None:
    assert linearise(paper_robot()).notes == ()


def test_a_slack_cable_is_noted_and_exerts_no_force() -> None:
    plant = linearise(third_slack(), BELOW)
    assert plant.notes[0] == "cable 3 is slack: it carries no tension, and the plant holds only while it stays slack"
    assert plant.tensions[2] == 0.0
    assert np.all(plant.system["tension_3", plant.system.input_labels](1j) == 0.0)
    assert np.all(plant.modes.cable_shares[2] == 0.0)


def test_a_platform_on_two_cables_swings_across_them_as_a_pendulum() -> None:
    # Both cables end 3 m above the platform, on a line about which it swings.
    frequencies = linearise(third_slack(), BELOW).modes.frequencies
    assert frequencies[0] == pytest.approx(np.sqrt(9.8 / 3.0) / (2 * np.pi), rel=1e-9)


@pytest.mark.parametrize("law", ["logarithmic", "linear"])
def test_a_slack_cable_has_rope_to_spare(law: str) -> None:
    robot = third_slack()
    robot = replace(robot, cables=tuple(replace(cable, law=law) for cable in robot.cables))
    plant = linearise(robot, BELOW)
    start = linearise(robot)
    strain = -start.tensions[2] / 1e4
    taut = 5.0 * (np.exp(-strain) if law == "logarithmic" else 1.0 - strain)
    assert taut < plant.state[8] < 1.01 * taut


def test_the_amplitude_that_slackens_a_cable_is_noted() -> None:
    plant = linearise(example("caroca"), swing=2.5e-3)
    assert len(plant.notes) == 1
    assert plant.notes[0].startswith("cable 3 becomes slack at an amplitude of 0.0023 m")
    slopes = plant.tension_slopes[2] @ plant.modes.shapes
    assert np.max(np.abs(slopes)) * 2.3e-3 == pytest.approx(plant.tensions[2], rel=0.03)


def test_friction_is_noted_with_the_error_of_its_linearisation() -> None:
    robot = with_effect(paper_robot(), "friction", coefficient=0.05, smoothing=0.005)
    (note,) = linearise(robot).notes
    assert note.startswith("winches 1, 2, 3: at ")
    assert "friction" in note
    # tanh x at x = speed / 5 mm/s, against x itself.
    speed = float(note.split(" at ")[1].split()[0]) / 0.005
    missed = float(note.split("up to ")[1].split("%")[0]) / 100.0
    assert missed == pytest.approx(1.0 - np.tanh(speed) / speed, abs=0.02)


def test_negligible_friction_is_not_noted() -> None:
    assert linearise(with_effect(paper_robot(), "friction", coefficient=1e-7)).notes == ()


def test_hysteresis_is_noted_for_the_modes_that_excite_it() -> None:
    robot = with_effect(with_damping(example("eight"), 3e8), "hysteresis", force=60.0, yield_strain=1e-4)
    notes = linearise(robot).notes
    assert [note.partition(":")[0] for note in notes] == ["mode 1", "mode 2", "mode 3"]
    assert all("hysteresis" in note for note in notes)


def test_smooth_effects_are_not_noted() -> None:
    robot = with_effect(paper_robot(damping=4e8), "relaxation", modulus=3e10, time=0.5)
    assert linearise(robot).notes == ()


def test_sensor_delays_are_noted() -> None:
    robot = with_effect(paper_robot(), "sensor_delay", tension_delay=0.02)
    assert linearise(robot).notes[0] == "tension 1: sensors are 0.02 s late, which the plant omits"


def test_a_platform_that_cables_hold_in_no_direction_but_one_is_refused() -> None:
    # Two cables straight above each other: nothing holds the platform against turning over between them.
    anchors = ((0.0, 0.0, 3.0), (0.0, 0.0, -3.0), (0.0, 0.0, 5.0), (0.0, 0.0, -5.0))
    cables = tuple(Cable(anchor, 1e9, 1e-5, 0.0, "logarithmic") for anchor in anchors)
    robot = Robot("column", 9.8, Platform(50.0, (0.0, 0.0, 0.0)), None, Sensors(), cables)
    plant = linearise(robot)
    assert plant.modes.frequencies[0] > 0.0
    light = replace(robot, gravity=0.0)
    with pytest.raises(OperatingPointError) as caught:
        linearise(light)
    assert caught.value.position == (0.0, 0.0, 0.0)


def test_a_formula_that_is_steep_at_rest_is_noted() -> None:
    notes = linearise(replace(paper_robot(), formulas=(Formula("force_z", "-50*tanh(vz/0.001)"),))).notes
    assert any("formula" in note and "nonsmooth" in note for note in notes)
