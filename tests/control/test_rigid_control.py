"""Controllers of platforms that turn: the design by itself, and the FMUs under it, against kinematics of its own."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.control import (
    ClosedLoopOptions,
    ControlAim,
    Controller,
    Feedforward,
    Range,
    RobustAim,
    RunOptions,
    build_controller_fmu,
    cosimulate_closed_loop,
    cosimulate_with_controller,
    design_controller,
    design_robust,
    elastic_reference,
    fmu_controller,
    margins_of,
    margins_over,
    path_tensions,
    rigid_reference,
    sample_times,
    schedule_controller,
    shaped,
    shaper,
    state_space_controller,
)
from tautwire.control.closed_loop import controller_wires
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tautwire.errors import ArgumentError, InputError
from tautwire.fmus.fmu_slots import SlotError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.linear import linearise
from tautwire.robot.pose_trajectory import PoseTrajectory, slerp
from tautwire.robot.schema import Robot
from tautwire.robot.trajectory import Line
from tests.support.rigid_robots import crane_robot, hall_robot, octahedral_robot
from tests.support.robots import example

Array = NDArray[np.float64]

DURATION = 1.0
TURN = (0.06, -0.05, 0.08)
STIFF = 100.0


def turning_path(robot: Robot) -> PoseTrajectory:
    """A line and a turn about a tilted axis, from where the robot starts."""
    x, y, z = robot.platform.start
    a, b, c, w = Rotation.from_rotvec(TURN).as_quat().tolist()
    return PoseTrajectory(
        Line((x, y, z), (x + 0.1, y - 0.08, z + 0.06), DURATION), slerp((1.0, 0.0, 0.0, 0.0), (w, a, b, c), DURATION)
    )


def path_errors(motion: CosimulationResult, path: PoseTrajectory) -> tuple[Array, Array]:
    """Distances (m) and angles (rad) from the path by SciPy's rotations about one axis, over time."""
    fraction = np.clip(motion.time / DURATION, 0.0, 1.0)
    share = fraction**3 * (10.0 - 15.0 * fraction + 6.0 * fraction**2)
    assert motion.orientation is not None
    shown = Rotation.from_quat(motion.orientation[:, [1, 2, 3, 0]])
    angles = (shown * Rotation.from_rotvec(np.outer(share, TURN)).inv()).magnitude()
    line = path.translation
    assert isinstance(line, Line)
    span = np.array(line.end) - np.array(line.start)
    return np.linalg.norm(motion.position - np.array(line.start) - np.outer(share, span), axis=1), angles


def stiffened(robot: Robot, factor: float) -> Robot:
    cables = tuple(replace(each, modulus=factor * each.modulus) for each in robot.cables)
    return replace(robot, cables=cables)


@pytest.fixture(scope="module")
def lqg() -> Controller:
    return design_controller(crane_robot())


@pytest.mark.validate(but=["hall"])
@pytest.mark.parametrize("robot", (crane_robot(), octahedral_robot(), hall_robot()), ids=lambda robot: robot.name)
def test_the_loop_around_the_model_is_stable_with_margins(robot: Robot) -> None:
    design = design_controller(robot)
    closed = control.feedback(design.plant, design.regulator, 1)
    assert np.abs(closed.poles()).max() < 0.995
    margins = margins_of(design.linear, design.knots()[0])
    assert margins.min_disk > 0.35 and margins.gain_margin > 2.0 and margins.phase_margin > 35.0


def test_a_lasting_load_leaves_no_error_of_the_pose(lqg: Controller) -> None:
    """The static gain from force and moment to the pose, with the controller in the loop, is zero."""
    system, n = lqg.linear.system, 8
    shown = system.C[[*range(6), *range(12, 20)]]
    plant = control.ss(
        np.block([[system.A, system.B[:, :n]], [np.zeros((n, system.nstates + n))]]),
        np.block([[np.zeros((system.nstates, n)), system.B[:, n:]], [np.eye(n), np.zeros((n, 6))]]),
        np.block([[shown, np.zeros((14, n))], [np.zeros((n, system.nstates)), np.eye(n)]]),
        0.0,
    )
    sampled = control.sample_system(plant, lqg.aim.period, method="zoh")
    opened = np.linalg.norm(np.linalg.inv(-system.A[6:12, :6]) @ system.B[6:12, n:], axis=0)
    closed = _with_feedback(sampled, lqg.regulator, n)
    gain = np.real(closed.dcgain())[:6]
    assert np.all(np.linalg.norm(gain, axis=0) < 1e-6 * opened)


def _with_feedback(plant: control.StateSpace, regulator: control.StateSpace, count: int) -> control.StateSpace:
    """From the loads, behind ``count`` accelerations among the plant's inputs, to all outputs, in closed loop."""
    of_winches, of_loads = plant.B[:, :count], plant.B[:, count:]
    A = np.block(
        [
            [plant.A + of_winches @ regulator.D @ plant.C, of_winches @ regulator.C],
            [regulator.B @ plant.C, regulator.A],
        ]
    )
    B = np.vstack([of_loads, np.zeros((regulator.nstates, of_loads.shape[1]))])
    C = np.hstack([plant.C, np.zeros((plant.noutputs, regulator.nstates))])
    return control.ss(A, B, C, 0.0, plant.dt)


@pytest.mark.validate
def test_the_closed_loop_follows_a_pose_path_under_noise(native_crane_fmus: RobotFmus, lqg: Controller) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    quiet = cosimulate_closed_loop(native_crane_fmus, robot, lqg, path, 1.2)
    distances, angles = path_errors(quiet, path)
    assert distances.max() < 1e-4 and angles.max() < 1e-4
    noisy = cosimulate_closed_loop(native_crane_fmus, robot, lqg, path, 1.2, ClosedLoopOptions(seed=5))
    distances, angles = path_errors(noisy, path)
    # Default noise: 0.1 mm, 0.2 mrad and 1 N a sample.
    assert distances.max() < 5e-4 and angles.max() < 5e-4
    assert noisy.tension.min() > 0.9 * path_tensions(robot, path, noisy.time).min()


def without_vector(fmus: RobotFmus, name: str, folder: Path) -> RobotFmus:
    """The FMUs with a platform of the user that has a vector by another name."""
    platform = folder / "platform.fmu"
    with zipfile.ZipFile(fmus.platform) as whole, zipfile.ZipFile(platform, "w") as changed:
        for item in whole.namelist():
            content = whole.read(item)
            is_description = item == "modelDescription.xml"
            changed.writestr(item, content.replace(f'"{name}.'.encode(), b'"own.') if is_description else content)
    return replace(fmus, platform=platform, user_start_values={"platform": {}})


@pytest.mark.validate
def test_what_the_controller_measures_does_not_depend_on_other_outputs(
    native_crane_fmus: RobotFmus, lqg: Controller, tmp_path: Path
) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    whole = cosimulate_closed_loop(native_crane_fmus, robot, lqg, path, 0.3)
    without_rates = without_vector(native_crane_fmus, "angular_velocity", tmp_path)
    motion = cosimulate_closed_loop(without_rates, robot, lqg, path, 0.3)
    assert motion.missing_columns == ("wx", "wy", "wz")
    assert motion.position == pytest.approx(whole.position, abs=1e-12)
    assert controller_wires(without_rates) == controller_wires(native_crane_fmus)


def test_a_platform_that_does_not_show_its_orientation_is_refused(
    native_crane_fmus: RobotFmus, lqg: Controller, tmp_path: Path
) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    blind = without_vector(native_crane_fmus, "orientation", tmp_path)
    with pytest.raises(InputError, match="the controller needs qw, qx, qy, qz, which no FMU outputs"):
        cosimulate_closed_loop(blind, robot, lqg, path, 0.3)
    with pytest.raises(InputError, match="the controller needs qw, qx, qy, qz, which no FMU outputs"):
        controller_wires(blind)


@pytest.mark.validate
def test_a_load_on_a_platform_without_an_input_for_it_is_refused(
    native_crane_fmus: RobotFmus, lqg: Controller, tmp_path: Path
) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    options = ClosedLoopOptions(external_force=np.tile([40.0, 0.0, -60.0], (31, 1)))
    (tmp_path / "held").mkdir()
    deaf = without_vector(native_crane_fmus, "external_force", tmp_path)
    with pytest.raises(SlotError, match=r"external_force\.x, external_force\.y, external_force\.z is no input"):
        cosimulate_closed_loop(deaf, robot, lqg, path, 0.3, options)
    whole = cosimulate_closed_loop(native_crane_fmus, robot, lqg, path, 0.3, options)
    without_rates = without_vector(native_crane_fmus, "external_force_rate", tmp_path / "held")
    held = cosimulate_closed_loop(without_rates, robot, lqg, path, 0.3, options)
    assert held.position == pytest.approx(whole.position, abs=1e-12)


@pytest.mark.validate
def test_feedback_corrects_a_load_that_nobody_declared(native_crane_fmus: RobotFmus, lqg: Controller) -> None:
    """A constant force and moment push the open loop off its path for good, the closed one for a moment."""
    robot, path = crane_robot(), turning_path(crane_robot())
    times = sample_times(0.01, 2.5)
    force, moment = np.tile([40.0, 0.0, -60.0], (len(times), 1)), np.tile([10.0, 0.0, 20.0], (len(times), 1))
    options = ClosedLoopOptions(external_force=force, external_moment=moment)
    ends = []
    for design in (Feedforward(8), lqg):
        motion = cosimulate_closed_loop(native_crane_fmus, robot, design, path, 2.5, options)
        ends.append([values[-1] for values in path_errors(motion, path)])
    assert ends[0][0] > 1e-4 and ends[0][1] > 3e-5
    assert ends[1][0] < 0.05 * ends[0][0] and ends[1][1] < 0.1 * ends[0][1]


@pytest.mark.validate
def test_feedforward_alone_follows_on_stiff_ropes_to_what_ramps_of_speed_leave(tmp_path: Path) -> None:
    robot = stiffened(octahedral_robot(), STIFF)
    path, times = turning_path(robot), sample_times(0.01, 1.1)
    options = ClosedLoopOptions(reference=rigid_reference(robot, path, times))
    motion = cosimulate_closed_loop(build_fmus(robot, tmp_path, native=True), robot, Feedforward(6), path, 1.1, options)
    distances, angles = path_errors(motion, path)
    assert distances.max() < 2e-5 and angles.max() < 2e-5


@pytest.mark.validate
def test_the_controller_fmu_makes_the_same_run(native_crane_fmus: RobotFmus, lqg: Controller, tmp_path: Path) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    reference = elastic_reference(robot, path, sample_times(0.01, 0.6))
    in_master = cosimulate_closed_loop(native_crane_fmus, robot, lqg, path, 0.6, ClosedLoopOptions(reference=reference))
    file = build_controller_fmu(robot, lqg, path, 0.6, tmp_path, reference)
    times = sample_times(0.01, 0.6)
    by_fmu = cosimulate_with_controller(native_crane_fmus, file, times)
    assert by_fmu.position == pytest.approx(in_master.position, abs=1e-9)
    assert by_fmu.orientation == pytest.approx(in_master.orientation, abs=1e-9)
    matched = fmu_controller(file, 8, is_rigid=True).speeds_from
    assert [matched.inputs[f"orientation.{part}"] for part in "wxyz"] == [f"orientation_{part}" for part in "wxyz"]
    with pytest.raises(InputError, match=r"its input orientation\.w is no signal of the robot"):
        fmu_controller(file, 8)


def test_controllers_from_elsewhere_measure_the_pose(native_crane_fmus: RobotFmus) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    speeds = [f"winch_speed_{number}" for number in robot.cable_numbers]
    inverse = np.linalg.pinv(-linearise(robot).system.C[20:28, :6])
    names = [f"{name}_{axis}" for name in ("position", "rotation") for axis in "xyz"]
    gain = 0.8 * np.linalg.pinv(inverse)
    proportional = control.ss([], [], [], -gain, 0.01, inputs=names, outputs=speeds)
    by_state_space = cosimulate_closed_loop(native_crane_fmus, robot, proportional, path, 1.2)
    measurements = []

    def function(time: float, measured: Array) -> Array:
        measurements.append(measured)
        return np.zeros(8)

    cosimulate_closed_loop(native_crane_fmus, robot, function, path, 0.05)
    assert measurements[0].shape == (3 + 4 + 8,)
    assert measurements[0][3:7] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    distances, angles = path_errors(by_state_space, path)
    assert distances.max() < 1e-3 and angles.max() < 1e-3
    with pytest.raises(ArgumentError, match="has the input 'rotation_x'"):
        state_space_controller(proportional, 8)


def test_a_controller_of_point_masses_is_refused(native_crane_fmus: RobotFmus, lqg: Controller) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    blind = replace(robot, platform=replace(robot.platform, inertia=None))
    x, y, z = robot.platform.start
    line = Line((x, y, z), (x, y, z + 0.1), 1.0)
    with pytest.raises(InputError, match="has another platform than the FMUs, that turns"):
        cosimulate_closed_loop(native_crane_fmus, blind, Feedforward(8), line, 1.0)
    of_points = design_controller(example("eight"))
    with pytest.raises(InputError, match=r"measures 11 signals, crane shows 14; design it for positions and rotations"):
        cosimulate_closed_loop(native_crane_fmus, robot, of_points, path, 1.0)
    with pytest.raises(ArgumentError, match=r"external_moment.*acts on a point mass"):
        options = RunOptions(external_moment=np.zeros((2, 3)))
        of_a_point = replace(native_crane_fmus, is_rigid=False)
        cosimulate_with_controller(of_a_point, Path(__file__), np.array([0.0, 1.0]), options)


def test_gains_are_scheduled_over_the_orientations_of_a_path() -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    schedule = schedule_controller(robot, path, points=3)
    orientations = path.orientation(np.array([0.0, 0.5, 1.0]) * DURATION)
    for plant, orientation in zip(schedule.plants, orientations, strict=True):
        assert plant.orientation == pytest.approx(tuple(orientation))
    at_end = design_controller(robot, None, path.position(np.array([1.0]))[0].tolist(), orientations[-1].tolist())
    assert pytest.approx(at_end.regulator.A) == schedule.controllers[-1].knots()[0].regulator.A


@pytest.mark.validate
@pytest.mark.parametrize("tension", ("lowest", "highest"))
def test_tensions_of_the_redundant_robot_stay_near_their_limits(
    native_crane_fmus: RobotFmus, lqg: Controller, tension: str
) -> None:
    robot, path = crane_robot(), turning_path(crane_robot())
    free = cosimulate_closed_loop(native_crane_fmus, robot, lqg, path, 1.2)
    if tension == "lowest":
        bound = 0.5 * (free.tension.min() + free.tension[0].min())
        held = _run_with(native_crane_fmus, path, ControlAim(lowest_tension=bound))
        assert free.tension.min() < bound - 1.0 and held.tension.min() > bound - 0.7 * (bound - free.tension.min())
    else:
        bound = 0.5 * (free.tension.max() + free.tension[0].max())
        held = _run_with(native_crane_fmus, path, ControlAim(highest_tension=bound))
        assert free.tension.max() > bound + 1.0 and held.tension.max() < bound + 0.7 * (free.tension.max() - bound)


def _run_with(fmus: RobotFmus, path: PoseTrajectory, aim: ControlAim) -> CosimulationResult:
    return cosimulate_closed_loop(fmus, crane_robot(), design_controller(crane_robot(), aim), path, 1.2)


@pytest.mark.validate
def test_feedback_damps_the_free_modes_of_four_cables(tmp_path: Path) -> None:
    robot = hall_robot()
    design = design_controller(robot)
    assert np.max(design.linear.modes.damping_ratios[:3]) < 2e-3
    poles = np.log(control.feedback(design.plant, design.regulator, 1).poles().astype(complex)) / design.aim.period
    swinging = [pole for pole in poles if pole.imag > 0.0 and abs(pole) < 20.0]
    assert len(swinging) >= 3 and min(-pole.real / abs(pole) for pole in swinging) > 0.04
    x, y, z = robot.platform.start
    path = Line((x, y, z), (x + 0.2, y + 0.1, z + 0.1), 1.5)
    fmus, rates = build_fmus(robot, tmp_path, native=True), []
    for law in (Feedforward(4), design):
        motion = cosimulate_closed_loop(fmus, robot, law, path, 6.0)
        assert motion.angular_velocity is not None
        rates.append(np.abs(motion.angular_velocity[motion.time > 5.0]).max())
    assert rates[1] < 0.2 * rates[0]


def test_a_plant_with_a_slack_cable_is_refused() -> None:
    robot = replace(hall_robot(), tension=None)
    with pytest.raises(InputError, match="hall: has no tension in cable 2 where the controller is to be designed"):
        design_controller(robot)


def test_a_shaped_pose_is_the_weighted_mean_of_delayed_ones() -> None:
    robot, times = crane_robot(), np.linspace(0.0, 2.0, 21)
    path, impulses = turning_path(robot), shaper(2.0, 0.01)
    both = shaped(path, impulses)
    assert isinstance(both, PoseTrajectory) and both.duration == pytest.approx(path.duration + impulses.delays[-1])
    pairs = zip(impulses.amplitudes, impulses.delays, strict=True)
    vectors = sum(a * Rotation.from_quat(path.orientation(times - d)[:, [1, 2, 3, 0]]).as_rotvec() for a, d in pairs)
    shown = Rotation.from_quat(both.orientation(times)[:, [1, 2, 3, 0]]).as_rotvec()
    assert shown == pytest.approx(vectors, abs=1e-12)
    fine = 1e-5
    later, earlier = (both.position(times + sign * fine) for sign in (1.0, -1.0))
    assert both.velocity(times) == pytest.approx((later - earlier) / (2.0 * fine), abs=1e-8)


@pytest.mark.validate
def test_the_robust_design_keeps_its_margin_over_the_range_on_a_platform_that_turns() -> None:
    robot, demanded = octahedral_robot(), RobustAim(margin=0.5)
    design = design_robust(robot, ControlAim(period=0.005), Range.of(robot), demanded)
    assert design.margins.min_disk >= 0.5
    worst = margins_over(robot, design.knots(), np.array([robot.platform.start]), Range.of(robot), points=2)
    assert worst.min_disk >= 0.5 - 1e-9 and worst.spectral_radius < 1.0
