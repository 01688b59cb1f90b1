"""A robot on winches: the whole chain against the rig, in the loop, and as an archive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from scipy.interpolate import CubicHermiteSpline

from tautwire.control import cosimulate_closed_loop, design_controller
from tautwire.cosimulation.robot_cosimulation import cosimulate, instantiate_robot, wire_fmus
from tautwire.cosimulation.ssp_archive import ssp_name, write_ssp
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot, Winch
from tests.control.test_lqg import PATHS, rms
from tests.rig import simulate
from tests.support.rig_robots import CORNERS, RAMP, drive_of, rig_of
from tests.support.robots import LIMITED, example, paper_robot, with_winch

SPEEDS = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
FREE = Winch(0.2, 15.0, 8.0, 0.7)


class DrivenProgram:
    """What the rig's drives make of commands that are linear between the corners."""

    def __init__(self, winch: Winch) -> None:
        self.kinks = tuple(CORNERS[1:-1])
        times = np.unique([*np.linspace(0.0, CORNERS[-1], 14001), *CORNERS])
        self.drives = []
        for column in SPEEDS.T:
            rows = drive_of(winch).run(lambda t, c=column: float(np.interp(t, CORNERS, c)), times, CORNERS)
            speed = CubicHermiteSpline(times, rows[:, 0], rows[:, 1])
            self.drives.append((speed, CubicHermiteSpline(times, rows[:, 2], rows[:, 0])))

    def speed(self, time: float) -> np.ndarray:
        return np.array([speed(time) for speed, _ in self.drives])

    def travel(self, time: float) -> np.ndarray:
        return np.array([travel(time) for _, travel in self.drives])


def end_of(robot: Robot, winch: Winch) -> np.ndarray:
    """Where the rig's platform ends."""
    return simulate(rig_of(robot), None, DrivenProgram(winch), CORNERS, rtol=1e-11, atol=1e-12).position[-1]


@pytest.fixture(scope="module")
def limited_end() -> np.ndarray:
    return end_of(paper_robot(), LIMITED)


@pytest.mark.validate
@pytest.mark.parametrize(("step", "bound"), [(0.02, 1e-6), (0.01, 1e-7), (0.002, 1e-8)])
def test_the_chain_ends_where_the_rig_ends_with_limits_on_the_way(
    native_winch_fmus: RobotFmus, limited_end: np.ndarray, step: float, bound: float
) -> None:
    motion = cosimulate(native_winch_fmus, CORNERS, SPEEDS, step)
    assert np.linalg.norm(motion.position[-1] - limited_end) < bound
    assert motion.statistics.energy_residual_share < 1e-9
    assert motion.statistics.fallback_notes() == ()


@pytest.mark.validate
def test_a_tolerance_holds_with_limits_on_the_way(native_winch_fmus: RobotFmus, limited_end: np.ndarray) -> None:
    motion = cosimulate(native_winch_fmus, CORNERS, SPEEDS, tolerance=1e-6)
    assert np.linalg.norm(motion.position[-1] - limited_end) < 1e-6
    assert motion.statistics.steps < 300


@pytest.mark.validate
def test_without_limits_as_well(tmp_path: Path) -> None:
    robot = paper_robot(damping=2.08e9)
    motion = cosimulate(build_fmus(with_winch(robot, FREE), tmp_path, native=True), CORNERS, SPEEDS)
    assert np.linalg.norm(motion.position[-1] - end_of(robot, FREE)) < 1e-7


@pytest.mark.validate
def test_a_result_tells_what_the_winches_did(native_winch_fmus: RobotFmus) -> None:
    motion = cosimulate(native_winch_fmus, CORNERS[:2], SPEEDS[:2])
    assert list(motion.winch_speed) == [1, 2, 3]
    exact = drive_of(LIMITED).run(lambda t: 0.25 * t, CORNERS[1:2])
    assert motion.winch_speed[2][-1] == pytest.approx(exact[0, 0], abs=1e-8)
    assert list(motion.frame().columns[-3:]) == ["winch_speed_1", "winch_speed_2", "winch_speed_3"]


def test_winches_go_first(winch_fmus: RobotFmus) -> None:
    with instantiate_robot(winch_fmus) as graph:
        assert [instance.component.name[:5] for instance in graph.instances] == [
            *["winch"] * 3,
            *["cable"] * 3,
            "platf",
        ]
        # The motion of winches in the middle of a step is not an output.
        assert graph.convergence_order == 4


@pytest.mark.validate
def test_stiff_winches_are_no_winches(tmp_path: Path) -> None:
    robot = paper_robot(damping=2.08e9)
    times = np.linspace(0.0, 2.0, 201)
    speeds = 0.05 * np.sin(1.5 * times[:, None] * np.array([1.0, 1.3, 0.7])) ** 2
    direct = cosimulate(build_fmus(robot, tmp_path / "direct", native=True), times, speeds)
    gaps = []
    for bandwidth in (5.0, 50.0):
        fmus = build_fmus(with_winch(robot, Winch(0.1, bandwidth=bandwidth)), tmp_path / str(bandwidth), native=True)
        gaps.append(np.max(np.abs(cosimulate(fmus, times, speeds).position - direct.position)))
    assert gaps[1] < 1e-5
    # A loop of this kind lags behind the second derivative of its command.
    assert gaps[0] / gaps[1] > 50.0


@pytest.mark.validate
def test_the_controller_holds_its_path_through_winches_of_ten_hertz(tmp_path: Path) -> None:
    robot, path = example("caroca"), PATHS["caroca"]
    errors = []
    for bandwidth in (10.0, 40.0):
        fmus = build_fmus(with_winch(robot, Winch(0.1, bandwidth=bandwidth)), tmp_path / str(bandwidth), native=True)
        held = cosimulate_closed_loop(fmus, robot, design_controller(robot), path, path.duration + 1.0)
        errors.append(np.linalg.norm(held.position - path.position(held.time), axis=1))
    assert rms(errors[1]) < rms(errors[0]) < 3e-4
    assert errors[0][-1] < 2e-5


def test_the_archive_has_them_and_asks_them_for_their_speeds(winch_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = with_winch(paper_robot(), LIMITED)
    description = read_ssd(str(write_ssp(robot, winch_fmus, tmp_path / ssp_name(robot))))
    assert [part.name for part in description.system.elements] == list(winch_fmus.by_component)
    ends = {
        (wire.startElement, wire.startConnector, wire.endElement, wire.endConnector)
        for wire in description.system.connections
    }
    assert ("winch_2", "winch_speed", "cable_2", "winch_speed") in ends
    assert ("winch_2", "winch_acceleration", "cable_2", "winch_acceleration") in ends
    assert (None, "speed_command_3", "winch_3", "speed_command") in ends
    assert ("winch_1", "winch_speed", None, "winch_speed_1") in ends
    assert not [wire for wire in ends if wire[0] is None and wire[2].startswith("cable")]


def test_the_wiring_asks_winches_where_there_are_some(tmp_path: Path) -> None:
    fmus = RobotFmus((Path("a"), Path("b"), Path("c")), Path("p"), (None, Path("w"), None))
    drives = [str(port) for port in wire_fmus(fmus).external_inputs]
    assert drives[::2] == ["cable_1.winch_speed", "winch_2.speed_command", "cable_3.winch_speed"]
    assert drives[1::2] == ["cable_1.winch_acceleration", "winch_2.speed_command_rate", "cable_3.winch_acceleration"]
