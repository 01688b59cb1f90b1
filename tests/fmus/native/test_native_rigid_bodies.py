"""Native rigid platforms beside those of Python."""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from numpy.typing import NDArray

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import RobotFmus
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.fmus import Hand, in_hand
from tests.support.native import both_kinds, largest_difference
from tests.support.rigid_robots import crane_robot, suspended_robot

Array = NDArray[np.float64]

EFFECTS = (
    EffectSetting("centre_of_mass", {"x": 0.02, "y": -0.01, "z": 0.03}),
    EffectSetting("attachment", {"x": 0.02, "z": -0.03}, (2,)),
    EffectSetting("inertia", {"factor_x": 1.5, "factor_y": 0.8, "factor_z": 1.2}),
    EffectSetting("rotational_drag", {"damping": 20.0}),
    EffectSetting("payload", {"mass": 10.0, "x": 0.1, "y": 0.2, "z": -0.1}),
    EffectSetting("drag", {"drag_area": 5.0, "wind_x": 3.0}),
    EffectSetting("sensor_gain", {"position_gain": 1.01}),
    EffectSetting("sensor_delay", {"position_delay": 0.03}),
)
# Of the values' sizes, at least one: rounding within the sweeps of a step.
SAME = 1e-12
# The iteration between FMUs leaves more, and rounding decides where it ends.
COUPLED = 1e-5


def with_all(robot: Robot) -> Robot:
    for effect in EFFECTS:
        robot = robot.with_effect(effect)
    return robot


@pytest.fixture(scope="module")
def complete_fmus(tmp_path_factory: pytest.TempPathFactory) -> tuple[RobotFmus, RobotFmus]:
    """A crane with all these effects, of Python and native."""
    return both_kinds(with_all(crane_robot()), tmp_path_factory.mktemp("crane"))


def shaken(hand: Hand) -> Array:
    """Variables after an extrapolated step, one with inputs at its end, and one with those of its middle."""
    names = [name for name in hand.references if not name.startswith(("der(", "event_indicator_"))]
    random = np.random.default_rng(1)
    load = [name for name in names if name.startswith(("force", "external", "middle_force"))]
    at_rest = dict(zip(load, hand.get(*load), strict=True))

    def push(time: float, middle: float = -1.0) -> None:
        values = {name: value + 50.0 * random.standard_normal() for name, value in at_rest.items()}
        values |= {"input_time": time, "middle_time": middle}
        hand.set(**{name.replace(".", "__"): value for name, value in values.items()})

    rows = [hand.get(*names)]
    hand.run()
    push(0.0)
    for time, inputs in ((0.0, ()), (0.02, ((0.02,), (0.04,))), (0.04, ((0.06, 0.05),))):
        for arguments in inputs:
            push(*arguments)
        hand.step(time, 0.02)
        rows.append(hand.get(*names))
    return np.array(rows)


def difference(one: Path, other: Path) -> float:
    rows = []
    for path in (one, other):
        with in_hand(path) as hand:
            rows.append(shaken(hand))
    scale = np.maximum(np.abs(rows[0]), 1.0)
    return float(np.max(np.abs(rows[0] - rows[1]) / scale))


@pytest.mark.validate
def test_a_crane_with_all_effects_moves_as_in_python(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    assert difference(complete_fmus[0].platform, complete_fmus[1].platform) < SAME


@pytest.mark.validate
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_each_effect_moves_it_as_in_python(effect: EffectSetting, tmp_path: Path) -> None:
    python, native = both_kinds(suspended_robot(4).with_effect(effect), tmp_path)
    assert difference(python.platform, native.platform) < SAME


@pytest.mark.validate
def test_coupled_to_cables_it_moves_as_in_python(tmp_path: Path) -> None:
    robot, time = suspended_robot(4), np.linspace(0.0, 0.4, 21)
    speed = np.outer(np.sin(8.0 * time) ** 2, [0.05, -0.02, 0.0, 0.01])
    python, native = (cosimulate(fmus, time, speed) for fmus in both_kinds(robot, tmp_path))
    assert largest_difference(python, native) < COUPLED


@pytest.mark.validate
def test_its_description_is_that_of_python_and_valid(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    one, other = (fmpy.read_model_description(str(fmus.platform)) for fmus in complete_fmus)
    assert [(v.name, v.start, v.unit) for v in one.modelVariables] == [
        (v.name, v.start, v.unit) for v in other.modelVariables[: len(one.modelVariables)]
    ]
    assert validate_fmu(str(complete_fmus[1].platform)) == []


@pytest.mark.validate
@pytest.mark.parametrize("values", [{"inertia__xy": 1e3}, {"start_orientation__w": 0.9}], ids=str)
def test_an_impossible_body_is_refused(values: dict[str, float], complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    with in_hand(complete_fmus[1].platform) as platform:
        platform.set(**values)
        with pytest.raises(FMICallException):
            platform.run()


@pytest.mark.validate
def test_principal_axes_follow_an_inertia_that_is_tuned(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    shown = []
    for fmus in complete_fmus:
        with in_hand(fmus.platform) as platform:
            platform.set(inertia__xy=9.0, inertia__xz=-7.0, effect__inertia__factor_x=2.0)
            platform.set(external_moment__x=100.0, external_moment__y=50.0)
            shown.append(platform.get(*(f"angular_acceleration.{axis}" for axis in "xyz")))
    assert shown[0] == pytest.approx(shown[1], rel=1e-12)
    assert abs(shown[0][0]) > 0.1
