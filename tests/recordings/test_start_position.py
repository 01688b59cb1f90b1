from dataclasses import replace

import numpy as np
import pytest

from tautwire.errors import UnreachableError
from tautwire.recordings.recording import Recording
from tautwire.recordings.start_position import start_pose, start_position, with_start
from tautwire.robot.schema import Platform, Robot
from tests.support.pose_recordings import noisy, rotation_of, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot, octahedral_robot, suspended_robot
from tests.support.robots import example

ROBOT = example("three")
FIT = recorded("three", 1)
NOISE = 3e-4


def moved(offset: list[float]) -> Recording:
    return replace(FIT, position=FIT.position + np.array(offset))


def test_noise_alone_does_not_move_the_start() -> None:
    start, notes = start_position(ROBOT, NOISE, FIT)
    assert start == ROBOT.platform.start
    assert notes == ()


def test_a_recording_that_starts_elsewhere_starts_where_it_says() -> None:
    recording = moved([0.0, 0.5, 0.0])
    start, notes = start_position(ROBOT, NOISE, recording)
    assert start == pytest.approx(recording.position[:5].mean(axis=0), abs=1e-12)
    assert "the run starts there too" in notes[0]
    assert with_start(ROBOT, start).platform.start == start


def test_a_missing_axis_stays_at_the_robot_files_start() -> None:
    recording = moved([0.0, 0.5, np.nan])
    start, _ = start_position(ROBOT, NOISE, recording)
    assert start[2] == ROBOT.platform.start[2]
    assert start[1] == pytest.approx(recording.position[:5, 1].mean(), abs=1e-12)


def test_a_first_row_that_dropped_out_does_not_hide_the_start() -> None:
    recording = moved([0.0, 0.5, 0.0])
    recording.position[:2] = np.nan
    start, _ = start_position(ROBOT, NOISE, recording)
    assert start[1] == pytest.approx(0.5, abs=1e-3)


def test_a_planar_robot_starts_in_its_plane_wherever_noise_shows_it() -> None:
    cables = tuple(
        replace(cable, anchor=(x, 0.0, cable.anchor[2]))
        for cable, x in zip(ROBOT.cables, (-9.0, 0.0, 9.0), strict=True)
    )
    x, _, z = ROBOT.platform.start
    planar = replace(ROBOT, cables=cables, platform=replace(ROBOT.platform, start=(x, 0.0, z)))
    assert planar.axes_in_plane == (0, 2)
    recording = replace(FIT, position=np.tile([x, 0.5, z], (len(FIT.time), 1)))
    assert start_position(planar, NOISE, recording)[0] == (x, 0.0, z)


ALONG, ACROSS = np.array([0.8, 0.6, 0.0]), np.array([-0.6, 0.8, 0.0])


def oblique_robot(cables: int) -> Robot:
    """A point mass on cables in a vertical plane that is turned by 37 degrees about z."""
    anchors = [3.0 * ALONG, np.array([0.0, 0.0, 3.0]), 3.0 * ALONG + [0.0, 0.0, 3.0]][-cables:]
    x, y, z = 1.4 * ALONG + [0.0, 0.0, 0.9]
    hung = [replace(ROBOT.cables[0], anchor=tuple(anchor.tolist())) for anchor in anchors]
    return replace(ROBOT, platform=Platform(50.0, (x, y, z)), cables=tuple(hung))


def started_at(point: np.ndarray) -> Recording:
    """A recording at rest at a point, in m."""
    return replace(
        FIT, position=np.tile(point, (len(FIT.time), 1)), winch_speed=0.0 * FIT.winch_speed, rope_length=None
    )


@pytest.mark.parametrize("cables", (2, 3))
def test_noise_does_not_lead_a_start_out_of_an_oblique_plane(cables: int) -> None:
    robot, elsewhere = oblique_robot(cables), 1.6 * ALONG + [0.0, 0.0, 1.1]
    start, notes = start_position(robot, NOISE, started_at(elsewhere + 2.0 * NOISE * ACROSS))
    assert start == pytest.approx(elsewhere, abs=1e-12)
    assert "the run starts there too" in notes[0]


def test_an_axis_without_positions_keeps_the_start_in_an_oblique_plane() -> None:
    start, _ = start_position(oblique_robot(2), NOISE, started_at(np.array([1.28, np.nan, 1.1])))
    assert start == pytest.approx(1.6 * ALONG + [0.0, 0.0, 1.1], abs=1e-12)


def test_a_start_beside_an_oblique_plane_by_more_than_noise_is_refused() -> None:
    with pytest.raises(UnreachableError, match=r"it is 0\.05 m beside it"):
        start_position(oblique_robot(2), NOISE, started_at(1.6 * ALONG + [0.0, 0.0, 1.1] + 0.05 * ACROSS))


def test_a_start_that_the_cables_cannot_hold_names_the_recording() -> None:
    with pytest.raises(UnreachableError, match=r"three-1\.csv: first positions: .*cable \d would need -"):
        start_position(ROBOT, NOISE, moved([-60.0, 0.0, 0.0]))


CRANE = crane_robot()
TURNED = replace(CRANE, platform=replace(CRANE.platform, start_orientation=(0.99875, 0.0, 0.0, 0.05)))


def test_noise_alone_does_not_turn_the_start() -> None:
    pose, notes = start_pose(CRANE, NOISE, noisy(wandering_recording(CRANE, travel=0.0, angle=0.0)))
    assert pose.orientation == CRANE.platform.start_orientation
    assert notes == ()


def test_a_platform_on_eight_cables_starts_turned_as_it_was_recorded() -> None:
    pose, notes = start_pose(TURNED, NOISE, noisy(wandering_recording(CRANE)))
    recorded_turn = (
        rotation_of(np.array(pose.orientation)) * rotation_of(np.array(CRANE.platform.start_orientation)).inv()
    )
    assert recorded_turn.magnitude() < 0.02
    assert notes[-1].startswith("log.csv starts turned by 5.") and "degrees from the robot file's start" in notes[-1]
    placed = with_start(TURNED, pose.position, pose.orientation)
    assert placed.platform.start_orientation == pose.orientation and placed.cables == TURNED.cables


def test_the_turned_start_has_to_be_held() -> None:
    robot = octahedral_robot()
    recording = wandering_recording(robot, travel=0.0)
    turned = np.tile([np.cos(0.7), 0.0, 0.0, np.sin(0.7)], (recording.sample_count, 1))
    with pytest.raises(UnreachableError, match=r"log\.csv: first orientations.*cable [135] would need -"):
        start_pose(robot, NOISE, replace(recording, orientation=turned))


def test_a_platform_that_cannot_be_held_may_be_shown_by_another_point() -> None:
    recording = noisy(wandering_recording(CRANE))
    with pytest.raises(UnreachableError) as e:
        start_pose(CRANE, NOISE, replace(recording, position=recording.position + np.array([0.0, 0.0, 3.9])))
    assert "another point of the platform than its origin, give attachments from there" in e.value.hint


def test_statics_decides_how_a_platform_on_four_cables_starts_turned() -> None:
    robot = suspended_robot(4)
    recording = wandering_recording(robot, travel=0.0)
    turned = np.tile([0.8, 0.0, 0.0, 0.6], (recording.sample_count, 1))
    pose, notes = start_pose(robot, NOISE, replace(recording, orientation=turned))
    assert pose.orientation == robot.platform.start_orientation and notes == ()
