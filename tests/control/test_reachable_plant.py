"""Designs of robots whose winches do not reach every direction: in planes, in rings, and with friction in the ropes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest

from tautwire.control import (
    ClosedLoopOptions,
    Feedforward,
    RobustController,
    ScheduledController,
    cosimulate_closed_loop,
    design_controller,
    design_robust,
    margins_of,
    ramp_plant,
    sample_times,
    schedule_controller,
    speed_controller,
)
from tautwire.control.reachable_plant import reach_notes, reachable_plant, require_reachable
from tautwire.errors import InputError
from tautwire.fmus.packaging import build_fmus
from tautwire.linear import linearise
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Cable, EffectSetting, Platform, Robot, Sensors, TensionLimits
from tautwire.robot.trajectory import Line
from tests.support import rigid_robots
from tests.support.planar import HORIZONTAL, VERTICAL, Plane, robot_text
from tests.support.rigid_robots import hung_beam, suspended_robot
from tests.support.robots import example

HYSTERESIS = {"force": 100.0, "yield_strain": 1e-4}


def planar_robot(folder: Path, plane: Plane) -> Robot:
    file = folder / "robot.toml"
    file.write_text(robot_text(plane))
    return read_robot(file)


def hung_point(*anchors: tuple[float, float, float]) -> Robot:
    """A point mass below its anchors, 1.4 m along x from the first."""
    cables = tuple(Cable(anchor, 1e10, 2e-6, 2e7, "logarithmic") for anchor in anchors)
    start = (1.4, 0.0, 0.9) if len(anchors) > 1 else (0.0, 0.0, 0.9)
    return Robot("hung", 9.81, Platform(5.0, start), None, Sensors(), cables)


@pytest.mark.parametrize("anchors", ([(0, 0, 2), (4, 2, 2)], [(0, 0, 2), (3, 3, 2), (2, 2, 0)]), ids=("two", "three"))
def test_lqg_in_an_oblique_plane_is_stable(anchors: list[tuple[float, float, float]]) -> None:
    limits = TensionLimits(10.0, 800.0, 80.0) if len(anchors) == 3 else None
    hung = hung_point(*anchors)
    x, y, _ = np.array(anchors[0]) + 0.25 * (np.array(anchors[1]) - anchors[0])
    robot = replace(hung, tension=limits, platform=Platform(5.0, (float(x), float(y), 0.9)))
    design = design_controller(robot)
    assert np.abs(control.feedback(design.plant, design.regulator, 1).poles()).max() < 0.99
    sums = [label for label in design.regulator.state_labels if label.endswith("_sum")]
    assert sums == ["position_x_error_sum", "position_z_error_sum"]


@pytest.fixture(params=("vertical", "horizontal", "two cables", "beam"))
def robot_in_plane(request: pytest.FixtureRequest, tmp_path: Path) -> Robot:
    if request.param == "two cables":
        return hung_point((0.0, 0.0, 2.0), (3.0, 0.0, 2.0))
    if request.param == "beam":
        return hung_beam()
    return planar_robot(tmp_path, VERTICAL if request.param == "vertical" else HORIZONTAL)


def test_lqg_in_a_plane_is_stable_and_integrates_along_its_axes(robot_in_plane: Robot) -> None:
    design = design_controller(robot_in_plane)
    assert np.abs(control.feedback(design.plant, design.regulator, 1).poles()).max() < 0.9995
    sums = [label for label in design.regulator.state_labels if label.endswith("_sum")]
    across = "z" if robot_in_plane.gravity == 0.0 else "y"
    assert sums == [f"position_{axis}_error_sum" for axis in "xyz" if axis != across]
    column = design.regulator.input_labels.index(f"position_{across}")
    assert np.all(np.abs(design.regulator.B[:, column]) < 1e-9)
    assert margins_of(linearise(robot_in_plane), design.knots()[0]).min_disk > 0.6


def test_what_winches_do_in_a_plane_stays_in_the_plant(robot_in_plane: Robot) -> None:
    linear = linearise(robot_in_plane)
    reduced = reachable_plant(linear)
    count, dropped = robot_in_plane.cable_count, 6 if robot_in_plane.platform.is_rigid_body else 2
    assert reduced.system.nstates == linear.system.nstates - dropped
    assert reachable_plant(reduced) is reduced
    for omega in (0.3, 7.0, 60.0):
        whole, part = (plant.system(1j * omega)[:, :count] for plant in (linear, reduced))
        assert part == pytest.approx(whole, rel=1e-8, abs=1e-10 * np.abs(whole).max())


def test_gains_of_a_planar_robot_are_scheduled(tmp_path: Path) -> None:
    robot = planar_robot(tmp_path, VERTICAL)
    x, y, z = robot.platform.start
    schedule = schedule_controller(robot, Line((x, y, z), (x + 0.2, y, z + 0.1), 1.0), points=3)
    labels = [controller.knots()[0].regulator.state_labels for controller in schedule.controllers]
    assert labels[0] == labels[1] == labels[2]


@pytest.mark.validate(but=["horizontal"])
@pytest.mark.parametrize("plane", (VERTICAL, HORIZONTAL), ids=("vertical", "horizontal"))
def test_closed_loop_in_a_plane_corrects_a_lasting_load(plane: Plane, tmp_path: Path) -> None:
    robot = planar_robot(tmp_path, plane)
    path = Line(robot.platform.start, tuple(np.add(robot.platform.start, plane.point(0.2, 0.1)).tolist()), 1.0)
    push = np.tile(plane.point(-3.0, -2.0), (len(sample_times(0.01, 3.0)), 1))
    fmus, ends = build_fmus(robot, tmp_path, native=True), []
    for law in (Feedforward(4), design_controller(robot)):
        motion = cosimulate_closed_loop(fmus, robot, law, path, 3.0, ClosedLoopOptions(external_force=push))
        ends.append(float(np.linalg.norm(motion.position[-1] - path.end)))
    assert ends[0] > 5e-5 and ends[1] < 0.02 * ends[0]


@pytest.mark.validate
def test_robust_design_in_a_plane_is_as_fast_as_the_modes_in_it(tmp_path: Path) -> None:
    design = design_robust(hung_point((0.0, 0.0, 2.0), (3.0, 0.0, 2.0)))
    assert design.margins.min_disk >= 2.0 / 3.0
    # The pendulum across the plane has 0.48 Hz, the lowest mode in it 6.2 Hz: the loop settles in far less than 1 s.
    assert design.margins.spectral_radius < 0.96


def test_mode_across_a_single_cable_is_refused_by_name() -> None:
    with pytest.raises(
        InputError, match=r"^hung: has a mode of 0\.475 Hz, along x and y, at \[0, 0, 0\.9\] m: no winch"
    ):
        design_controller(hung_point((0.0, 0.0, 2.0)))


@pytest.mark.validate
@pytest.mark.parametrize("count", (3, 4, 6, 8))
def test_undamped_turn_in_a_ring_of_cables_is_refused_by_name(count: int) -> None:
    message = r"suspended: has a mode of 1\.1 Hz, rotation about z, at \[0, 0, 1\.5\] m: no winch reaches it"
    for design in (design_controller, design_robust):
        with pytest.raises(InputError, match=message):
            design(suspended_robot(count))


@pytest.mark.parametrize("count", (6, 8))
def test_damped_turn_in_a_ring_of_cables_is_left_to_itself(count: int) -> None:
    damping = EffectSetting("rotational_drag", {"damping": 2.0}, ())
    design = design_controller(replace(suspended_robot(count), effects=(damping,)))
    assert np.abs(control.feedback(design.plant, design.regulator, 1).poles()).max() < 0.9995
    sums = [label for label in design.regulator.state_labels if label.endswith("_sum")]
    assert sums == [f"position_{axis}_error_sum" for axis in "xyz"]


def test_friction_between_strands_stiffens_the_plant_of_the_design() -> None:
    robot = replace(example("three"), effects=(EffectSetting("hysteresis", HYSTERESIS, (1, 2, 3)),))
    design = design_controller(robot)
    assert np.abs(control.feedback(design.plant, design.regulator, 1).poles()).max() < 0.99
    assert list(design.linear.system.state_labels) == list(linearise(example("three")).system.state_labels)
    assert margins_of(linearise(robot), design.knots()[0]).min_disk > 0.3


@pytest.mark.validate
def test_a_loop_that_small_errors_unsettle_is_noted() -> None:
    assert design_controller(example("three")).notes == ()
    design = design_controller(rigid_robots.underactuated_robot())
    (note,) = design.notes
    assert note.startswith("at [1.63957, -0.620978, -0.968457] m: the loop has a disk margin of 0.003")
    # By the poles of the loop alone, with all gains wrong by as much as a margin of 0.1 would allow.
    plant, feedback = ramp_plant(design.linear, design.aim.period), speed_controller(design.regulator)
    radii = [max(abs(control.feedback(plant, gain * feedback, 1).poles())) for gain in (1.0, 1.11, 1.0 / 1.11)]
    assert radii[0] < 1.0 < max(radii[1:])
    assert ScheduledController((0.0, 1.0), (design, design)).notes == (note, note)


def test_a_mode_that_winches_hardly_reach_is_noted_although_margins_are_good() -> None:
    design = design_controller(hung_beam())
    (note,) = design.notes
    assert note.startswith("at [1.8, 0, 1] m: the winches hardly reach the mode of 1.64 Hz, rotation about y: moving ")
    # Feedback leaves it with little damping: by the poles of the closed loop, in 1/s.
    poles = np.log(control.feedback(design.plant, design.regulator, 1).poles().astype(complex)) / design.aim.period
    (swing,) = (pole for pole in poles if abs(pole.imag / (2.0 * np.pi) - 1.64) < 0.01)
    assert -swing.real / abs(swing) < 0.01


def test_winch_motion_of_a_mode_is_that_of_the_closed_form() -> None:
    # Two cables of 2 m whose exit points are 0.4 mm apart: stiffness k s^2 of the ropes, T / l of the pendulum.
    k, sine, tension = 1e10 * 2e-6 / 2.0, 1e-4, 5.0 * 9.81 / 2.0
    robot = replace(hung_point((-2e-4, 0.0, 2.0), (2e-4, 0.0, 2.0)), platform=Platform(5.0, (0.0, 0.0, 0.0)))
    ratio = (2.0 * k * sine**2 + 2.0 * tension / 2.0) / (np.sqrt(2.0) * k * sine)
    (note,) = reach_notes(reachable_plant(linearise(robot)))
    assert f"along x: moving the platform by 1 mm in it takes winch motions of {ratio:.2g} mm" in note
    nearer = replace(hung_point((-2e-3, 0.0, 2.0), (2e-3, 0.0, 2.0)), platform=robot.platform)
    assert reach_notes(reachable_plant(linearise(nearer))) == ()


@pytest.mark.parametrize("robot", ("caroca", "caroca8", "cogiro", "eight", "fast", "ipanema", "three"))
def test_winches_of_known_robots_reach_all_modes(robot: str) -> None:
    assert reach_notes(reachable_plant(linearise(example(robot)))) == ()


def test_a_schedule_and_a_robust_design_note_what_winches_hardly_reach() -> None:
    design = design_controller(hung_beam())
    (note,) = design.notes
    assert ScheduledController((0.0, 1.0), (design, design)).notes == (note, note)
    margins = margins_of(design.linear, design.knots()[0])
    robust = RobustController(design.aim, design.regulator, design.tracking, design.linear, 1.0, margins)
    assert robust.notes == (note,)


def test_plant_within_reach_is_left_as_it_is() -> None:
    linear = linearise(example("three"))
    assert reachable_plant(linear) is linear


def test_mode_that_no_sensor_shows_is_refused() -> None:
    linear = linearise(example("three"))
    system = linear.system
    blind = control.ss(
        system.A, system.B, 0.0 * system.C, system.D, inputs=system.input_labels, states=system.state_labels
    )
    with pytest.raises(InputError, match=r"at standstill, of position_x, at .* neither pose nor tensions show it"):
        require_reachable("three", replace(linear, system=blind))
