"""The winch's FMU: it is the law, whatever the steps, within its limits, and good to any master."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Winch
from tests.support.fmus import Hand, in_hand
from tests.support.rig_robots import drive_of
from tests.support.robots import LIMITED, paper_robot, with_winch

CORNERS = [0.0, 0.5, 1.0, 2.0, 2.2, 3.0]
SPEEDS = [0.0, 0.6, 0.6, -1.2, -1.2, 0.0]


@pytest.fixture
def limited(winch_fmus: RobotFmus) -> Path:
    """A winch as :data:`LIMITED` declares it."""
    return winch_fmus.by_component["winch_2"]


def command(time: float) -> float:
    """Ramps and holds beyond the limits of :data:`LIMITED`."""
    return float(np.interp(time, CORNERS, SPEEDS))


def slope(time: float) -> float:
    """Its rate around a time that is no corner."""
    place = int(np.searchsorted(CORNERS, time)) - 1
    return (SPEEDS[place + 1] - SPEEDS[place]) / (CORNERS[place + 1] - CORNERS[place])


def stamped(hand: Hand, begin: float, end: float) -> None:
    """One step with the command at both ends."""
    rate = slope(0.5 * (begin + end))
    hand.set(input_time=begin)
    hand.set(speed_command=command(begin), speed_command_rate=rate)
    hand.set(input_time=end)
    hand.set(speed_command=command(end), speed_command_rate=rate)
    hand.step(begin, end - begin)


def extrapolated(hand: Hand, begin: float, end: float) -> None:
    """One step as a master makes it that knows of no stamps."""
    hand.set(speed_command=command(begin), speed_command_rate=slope(0.5 * (begin + end)))
    hand.step(begin, end - begin)


def followed(path: Path, step: float, advance: Callable[[Hand, float, float], None]) -> np.ndarray:
    """Speed and acceleration after each step, shape (N, 2)."""
    rows = []
    with in_hand(path) as winch:
        winch.run()
        for k in range(round(3.0 / step)):
            advance(winch, k * step, (k + 1) * step)
            rows.append(winch.get("winch_speed", "winch_acceleration"))
    return np.array(rows)


WINCHES = {
    "free": Winch(0.1),
    "acceleration": Winch(0.1, acceleration_limit=1.3),
    "speed": Winch(0.1, speed_limit=0.5),
    "both": LIMITED,
    "springy": Winch(0.1, 8.0, 10.0, 0.3, 0.5, 40.0),
}


@pytest.mark.validate
@pytest.mark.parametrize("name", WINCHES)
def test_it_is_the_rigs_drive_whatever_the_steps(name: str, tmp_path: Path) -> None:
    winch = WINCHES[name]
    path = build_fmus(with_winch(paper_robot(), winch), tmp_path).by_component["winch_1"]
    for step, advance in ((0.1, stamped), (0.01, stamped), (0.01, extrapolated)):
        times = step * np.arange(1, round(3.0 / step) + 1)
        exact = drive_of(winch).run(command, times, CORNERS)
        error = np.max(np.abs(followed(path, step, advance) - exact[:, :2]), axis=0)
        assert error[0] < 2e-7
        assert error[1] < 2e-5


def test_one_long_step_meets_all_limits_on_its_way(limited: Path) -> None:
    def wide(time: float) -> float:
        return 3.0 * time * (1.0 - time) * 4.0

    with in_hand(limited) as winch:
        winch.set(speed_command_rate=12.0)
        winch.run()
        winch.set(input_time=1.0)
        winch.set(speed_command=wide(1.0), speed_command_rate=-12.0)
        winch.step(0.0, 1.0)
        result = winch.get("winch_speed", "winch_acceleration")
    exact = drive_of(LIMITED).run(wide, np.array([1.0]))
    assert result == pytest.approx(exact[0, :2], abs=2e-6)


@pytest.mark.parametrize("seconds", [2.0, 20.0])
def test_it_comes_out_of_its_limits_alike_however_long_it_was_there(limited: Path, seconds: float) -> None:
    with in_hand(limited) as winch:
        winch.set(speed_command=50.0)
        winch.run()
        winch.step(0.0, seconds)
        assert winch.get("winch_speed")[0] == pytest.approx(0.9, abs=1e-12)
        winch.set(speed_command=0.8)
        winch.step(seconds, 0.05)
        assert winch.get("winch_speed")[0] == pytest.approx(0.8249, abs=2e-4)


def test_no_limit_is_ever_passed(limited: Path) -> None:
    jumps = np.random.default_rng(3).uniform(-3.0, 3.0, 120)
    with in_hand(limited) as winch:
        winch.run()
        for k, jump in enumerate(jumps):
            winch.set(speed_command=float(jump))
            winch.step(0.07 * k, 0.07)
            speed, acceleration, motor = winch.get("winch_speed", "winch_acceleration", "motor_speed")
            assert abs(speed) <= 0.9
            assert abs(acceleration) <= 1.5
            assert motor == pytest.approx(15.0 / 0.2 * speed, rel=1e-15)


def test_acceleration_follows_the_command_at_once(limited: Path) -> None:
    with in_hand(limited) as winch:
        winch.set(speed_command=0.001)
        assert winch.get("winch_speed", "winch_acceleration") == pytest.approx([0.0, 4.0 * np.pi * 8.0 * 0.7e-3])
        winch.set(bandwidth=4.0)
        assert winch.get("winch_acceleration") == pytest.approx([4.0 * np.pi * 4.0 * 0.7e-3])


def shown_after_steps(winch: Hand) -> list[float]:
    for k in range(3):
        winch.set(speed_command=0.5 - 0.4 * k, speed_command_rate=0.1 * k)
        winch.step(0.1 + 0.02 * k, 0.02)
    return winch.get("winch_speed", "winch_acceleration", "motor_speed", "integral")


def test_a_saved_state_is_all_of_it_in_this_instance_and_in_another(limited: Path) -> None:
    with in_hand(limited) as winch, in_hand(limited) as other:
        winch.set(speed_command=0.4, gear=3.0)
        winch.run()
        other.run()
        winch.step(0.0, 0.1)
        saved = winch.fmu.getFMUstate()
        content = winch.fmu.serializeFMUstate(saved)
        expected = shown_after_steps(winch)
        winch.fmu.setFMUstate(saved)
        assert shown_after_steps(winch) == expected
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(content))
        assert shown_after_steps(other) == expected


@pytest.mark.parametrize("step", [0.0, -0.01, float("nan"), 1e9])
def test_an_impossible_step_is_refused_and_changes_nothing(limited: Path, step: float) -> None:
    with in_hand(limited) as winch:
        winch.set(speed_command=0.4)
        winch.run()
        winch.step(0.0, 0.1)
        before = winch.get("winch_speed", "winch_acceleration", "integral")
        with pytest.raises(FMICallException):
            winch.step(0.1, step)
        assert winch.get("winch_speed", "winch_acceleration", "integral") == before


@pytest.mark.parametrize(
    "wrong",
    [
        {"drum_radius": 0.0},
        {"damping_ratio": 0.0},
        {"bandwidth": 1e300},
    ],
)
def test_impossible_numbers_do_not_bring_the_process_down(limited: Path, wrong: dict[str, float]) -> None:
    with in_hand(limited) as winch:
        winch.set(**wrong)
        shown = winch.get("winch_speed", "winch_acceleration", "motor_speed")
        winch.run()
        for _ in range(4):
            if "drum_radius" not in wrong:
                with pytest.raises(FMICallException):
                    winch.step(0.0, 0.01)
        assert len(shown) == 3
