"""Co-simulated rigid platforms against their equations as one system, and against point masses."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.fmu_slots import SlotError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import EffectSetting, Robot, UserFmu
from tautwire.robot.static_equilibrium import start_orientation, static_tensions
from tests.support.rigid_motion import RigidMotion, RigidRobot, integrated, rotation_matrices
from tests.support.rigid_robots import crane_robot, suspended_robot, underactuated_robot
from tests.support.robots import paper_robot

Array = NDArray[np.float64]

CORNERS = np.array([0.0, 0.5, 1.0, 1.5, 2.0])


def ramp_speeds(robot: Robot) -> Array:
    """Winch speeds at the corners that move and turn a platform steadily from rest, if ropes were inelastic."""

    def lengths(times: Array) -> Array:
        turned = Rotation.from_rotvec(np.outer(times, [0.05, -0.08, 0.1])).as_matrix()
        position = np.array(robot.platform.start) + np.outer(times, [0.2, 0.1, 0.15])
        points = position[:, None] + np.array(robot.attachments) @ np.swapaxes(turned, 1, 2)
        return np.asarray(np.linalg.norm(np.array(robot.anchors) - points, axis=2))

    speeds = (lengths(CORNERS - 1e-5) - lengths(CORNERS + 1e-5)) / 2e-5
    speeds[0] = 0.0
    return speeds


def motion_of(result: CosimulationResult) -> RigidMotion:
    assert result.orientation is not None and result.angular_velocity is not None
    rotation = rotation_matrices(result.orientation)
    return RigidMotion(result.position, result.velocity, rotation, result.angular_velocity, result.tension)


def start_of(robot: Robot) -> tuple[Array, Array]:
    return np.array(start_orientation(robot)), static_tensions(robot)


def pose_error(found: RigidMotion, exact: RigidMotion) -> float:
    """Largest error of positions (m) and of the rotation matrix."""
    return float(max(np.max(np.abs(found.position - exact.position)), np.max(np.abs(found.rotation - exact.rotation))))


def test_the_ramp_of_eight_cables_errs_by_less_than_a_nanometre(native_crane_fmus: RobotFmus) -> None:
    robot = crane_robot()
    speeds = ramp_speeds(robot)
    result = cosimulate(native_crane_fmus, CORNERS, speeds, 0.01)
    found, exact = motion_of(result), integrated(robot, start_of(robot), CORNERS, speeds)
    assert pose_error(found, exact) < 1e-9
    assert np.max(np.abs(found.velocity - exact.velocity)) < 1e-7
    assert np.max(np.abs(found.angular_velocity - exact.angular_velocity)) < 1e-7
    assert np.max(np.abs(found.tension - exact.tension)) < 1e-3
    assert result.orientation is not None
    assert np.max(np.abs(np.linalg.norm(result.orientation, axis=1) - 1.0)) <= 1e-15
    # Torn at the forces it would be seven iterations.
    assert result.statistics.iterations < 2 * result.statistics.steps
    assert result.statistics.energy_residual_share < 1e-9


@pytest.mark.validate
@pytest.mark.parametrize(("step", "error"), [(0.05, 8.6e-7), (0.025, 1.6e-8), (0.0125, 2.5e-10), (0.005, 2.5e-12)])
def test_the_documentation_tells_the_errors(native_crane_fmus: RobotFmus, step: float, error: float) -> None:
    robot = crane_robot()
    speeds = ramp_speeds(robot)
    found = motion_of(cosimulate(native_crane_fmus, CORNERS, speeds, step))
    assert pose_error(found, integrated(robot, start_of(robot), CORNERS, speeds)) < 1.5 * error


@pytest.mark.validate
def test_the_order_is_above_five(native_crane_fmus: RobotFmus) -> None:
    robot = crane_robot()
    speeds = ramp_speeds(robot)
    exact = integrated(robot, start_of(robot), CORNERS, speeds)
    coarse, fine = (
        pose_error(motion_of(cosimulate(native_crane_fmus, CORNERS, speeds, h)), exact) for h in (0.02, 0.01)
    )
    assert np.log2(coarse / fine) > 5.0


@pytest.mark.validate
def test_a_platform_on_four_cables_swings_as_its_equations_say(tmp_path: Path) -> None:
    robot = suspended_robot(4)
    time = np.array([0.0, 0.2, 0.4, 1.0])
    speeds = np.zeros((4, 4))
    speeds[1, :2] = [0.6, -0.2]
    found = motion_of(cosimulate(build_fmus(robot, tmp_path, native=True), time, speeds, 0.01))
    exact = integrated(robot, start_of(robot), time, speeds)
    assert np.max(np.abs(exact.rotation[-1] - exact.rotation[0])) > 0.01
    assert pose_error(found, exact) < 1e-7


@pytest.mark.validate
def test_attached_at_the_centre_of_mass_it_moves_as_a_point(three_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = paper_robot()
    inertia = ((30.0, 1.0, 2.0), (1.0, 20.0, 3.0), (2.0, 3.0, 25.0))
    rigid = replace(robot, platform=replace(robot.platform, inertia=inertia))
    time = np.array([0.0, 1.0, 2.0])
    speeds = np.outer(time, [0.3, 0.25, -0.25])
    point_run = cosimulate(three_fmus, time, speeds)
    rigid_run = cosimulate(build_fmus(rigid, tmp_path, native=True), time, speeds)
    assert rigid_run.position == pytest.approx(point_run.position, abs=1e-11)
    assert rigid_run.tension == pytest.approx(point_run.tension, abs=1e-6)
    assert rigid_run.orientation == pytest.approx(np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), abs=0.0)
    assert point_run.orientation is None and point_run.angular_velocity is None


def test_at_rest_nothing_turns(native_crane_fmus: RobotFmus) -> None:
    result = cosimulate(native_crane_fmus, np.array([0.0, 0.5, 1.0]), np.zeros((3, 8)))
    assert np.max(np.abs(result.position - result.position[0])) < 1e-10
    assert result.orientation is not None
    assert np.max(np.abs(result.orientation - result.orientation[0])) < 1e-10
    assert np.max(np.abs(result.tension - result.tension[0])) < 1e-5


def test_the_frame_has_orientation_and_angular_velocity(native_crane_fmus: RobotFmus) -> None:
    result = cosimulate(native_crane_fmus, np.array([0.0, 0.01]), np.zeros((2, 8)))
    frame = result.frame()
    expected = ["time", "x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx", "wy", "wz", "tension_1"]
    assert list(frame.columns[:15]) == expected
    assert np.array_equal(frame[["qw", "qx", "qy", "qz"]].to_numpy(), result.orientation)
    assert np.array_equal(frame["strain_8"], result.strain[:, 7])


@pytest.mark.validate
def test_a_users_platform_turns_in_the_slot(native_crane_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = crane_robot()
    speeds = ramp_speeds(robot)[:2]
    own = build_fmus(replace(robot, fmus=(UserFmu("platform", native_crane_fmus.platform),)), tmp_path, native=True)
    ours, theirs = (cosimulate(fmus, CORNERS[:2], speeds) for fmus in (native_crane_fmus, own))
    assert np.array_equal(theirs.orientation, ours.orientation)


def expected_to_start_at(fmus: RobotFmus, start: tuple[float, ...], folder: Path) -> RobotFmus:
    """The FMUs with a platform whose start orientation is fixed, in a robot that starts at another quaternion."""
    fixed = folder / "fixed.fmu"
    with zipfile.ZipFile(fmus.platform) as whole, zipfile.ZipFile(fixed, "w") as changed:
        for entry in whole.namelist():
            changed.writestr(entry, whole.read(entry).replace(b'name="start_orientation.', b'name="other.'))
    expected = {"start.x": 0.3, "start.y": -0.2, "start.z": 1.5}
    expected |= {f"start_orientation.{part}": value for part, value in zip("wxyz", start, strict=True)}
    return replace(fmus, platform=fixed, user_start_values={"platform": expected})


def test_a_users_platform_that_starts_turned_is_refused(native_crane_fmus: RobotFmus, tmp_path: Path) -> None:
    turned = expected_to_start_at(native_crane_fmus, (0.6, 0.8, 0.0, 0.0), tmp_path)
    with pytest.raises(SlotError, match=r"it starts at 1, 0, 0, 0, the run at 0.6, 0.8, 0, 0.*start_orientation.z"):
        cosimulate(turned, CORNERS[:2], np.zeros((2, 8)))


def test_a_users_platform_may_start_at_the_other_sign_of_its_quaternion(
    native_crane_fmus: RobotFmus, tmp_path: Path
) -> None:
    same = expected_to_start_at(native_crane_fmus, (-1.0, 0.0, 0.0, 0.0), tmp_path)
    runs = [cosimulate(fmus, CORNERS[:2], np.zeros((2, 8))) for fmus in (native_crane_fmus, same)]
    assert runs[1].position == pytest.approx(runs[0].position, abs=1e-12)


@pytest.mark.validate
def test_a_payload_sits_at_the_centre_of_mass(tmp_path: Path) -> None:
    robot = suspended_robot(4)
    heavier = replace(robot, platform=replace(robot.platform, mass=robot.platform.mass + 20.0))
    loaded = robot.with_effect(EffectSetting("payload", {"mass": 20.0}))
    time, speeds = np.array([0.0, 0.2, 0.4]), np.zeros((3, 4))
    speeds[1, 0] = 0.5
    runs = [
        cosimulate(build_fmus(each, tmp_path / str(index)), time, speeds)
        for index, each in enumerate((heavier, loaded))
    ]
    assert runs[1].position == pytest.approx(runs[0].position, abs=1e-12)
    assert runs[1].orientation == pytest.approx(runs[0].orientation, abs=1e-12)


@pytest.mark.validate
def test_a_position_sensor_shows_the_origin_late_and_scaled(native_crane_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = crane_robot().with_effect(EffectSetting("sensor_gain", {"position_gain": 1.01}))
    robot = robot.with_effect(EffectSetting("sensor_delay", {"position_delay": 0.02}))
    time, speeds = np.array([0.0, 0.5, 0.54, 0.56]), np.zeros((4, 8))
    speeds[1:] = ramp_speeds(crane_robot())[1]
    shown = cosimulate(build_fmus(robot, tmp_path, native=True), time, speeds)
    truth = cosimulate(native_crane_fmus, time, speeds)
    assert shown.position[3] == pytest.approx(1.01 * truth.position[2], abs=1e-7)
    assert shown.orientation == pytest.approx(truth.orientation, abs=1e-12)


def lowest_mode(robot: Robot) -> Array:
    """Winch speeds (8,) that swing a platform in its slowest mode, at most 0.1 m/s fast."""
    system = RigidRobot(robot, static_tensions(robot))
    rest = system.start(np.array(start_orientation(robot)))
    weight = np.array([0.0, 0.0, -robot.platform.mass * robot.gravity])

    def wrench(pose: Array) -> Array:
        turned = Rotation.from_rotvec(pose[3:]).as_matrix()
        state = np.concatenate([rest[:3] + pose[:3], rest[3:6], turned.ravel(), rest[15:]])
        tensions, units, _ = system.ropes(state, np.zeros(len(system.axial)))
        forces = tensions[:, None] * units
        moment = np.cross(system.attachments @ turned.T, forces).sum(axis=0) + np.cross(turned @ system.centre, weight)
        return np.concatenate([forces.sum(axis=0) + weight, moment])

    steps = 1e-6 * np.eye(6)
    stiffness = -np.array([(wrench(step) - wrench(-step)) / 2e-6 for step in steps]).T
    x, y, z = system.centre
    coupling = robot.platform.mass * np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    about_origin = system.inertia + coupling.T @ coupling / robot.platform.mass
    mass = np.block([[robot.platform.mass * np.eye(3), coupling], [coupling.T, about_origin]])
    mode = eigh(0.5 * (stiffness + stiffness.T), mass)[1][:, 0]
    mode *= 0.1 / np.max(np.abs(mode[:3]))
    _, units, _ = system.ropes(rest, np.zeros(len(system.axial)))
    return np.asarray(np.hstack([units, np.cross(system.attachments, units)]) @ mode)


@pytest.mark.validate
@pytest.mark.parametrize(("periods", "bound"), [(20, 1e-8), (300, 2e-8)])
def test_the_energy_of_a_free_swing_stays(periods: int, bound: float, tmp_path: Path) -> None:
    robot = crane_robot()
    robot = replace(robot, cables=tuple(replace(cable, damping=0.0, modulus=1e10) for cable in robot.cables))
    time = np.concatenate([[0.0, 0.1, 0.2, 0.3], np.arange(0.35, 0.3 + periods / 1.86, 0.05)])
    speeds = np.zeros((len(time), 8))
    speeds[1:3] = lowest_mode(robot)
    result = cosimulate(build_fmus(robot, tmp_path, native=True), time, speeds, 0.01)
    motion = motion_of(result)
    kinetic, energy = RigidRobot(robot, static_tensions(robot)).energy(motion, result.length)
    assert np.max(kinetic[4:]) > 0.5
    assert np.ptp(energy[3:]) < bound * np.max(kinetic[4:])


def frequencies(signals: Array, interval: float, count: int) -> Array:
    """Frequencies in Hz of so many undamped sines in signals (N, k), ascending, by the matrix pencil."""
    half = len(signals) // 2
    rows = [signals[index : index + half] for index in range(len(signals) - half)]
    basis = np.linalg.svd(np.concatenate(rows, axis=1), full_matrices=False)[0][:, : 2 * count + 2]
    poles = np.linalg.eigvals(np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0])
    found = np.abs(np.angle(poles)) / (2.0 * np.pi * interval)
    return np.unique(np.round(found[found > 0.1], 6))


@pytest.mark.validate
def test_a_real_platform_swings_at_the_frequencies_of_an_independent_program(tmp_path: Path) -> None:
    robot = underactuated_robot()
    time = np.concatenate([[0.0, 0.1, 0.2, 0.3, 0.4], np.arange(0.5, 16.0, 0.1)])
    speeds = np.zeros((len(time), 4))
    # What the winches take they give back, as the modes depend on the place.
    speeds[1] = [0.002, -0.001, 0.0015, -0.002]
    speeds[3] = -speeds[1]
    result = cosimulate(build_fmus(robot, tmp_path, native=True), time, speeds, 0.005)
    assert result.orientation is not None
    poses = np.hstack([result.position, result.orientation])[5:]
    poses -= poses.mean(axis=0)
    found = frequencies(poses / poses.std(axis=0), 0.1, 2)
    assert found[found < 2.0] == pytest.approx([0.823150845872805, 1.1938873382695399], rel=3e-4)
