"""The scene draws what was measured beside another path by its deviation from that."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tautwire.reports.check_figures import robot_scene
from tautwire.reports.robot_scene import (
    MAX_SCENE_NUMBERS,
    RobotScene,
    frame_indices,
    hull_edges,
    measured_path,
    pack_columns,
    scene_data,
)
from tests.support.rigid_robots import suspended_robot
from tests.support.rigid_runs import made_rigid_recording

TIME = 0.02 * np.arange(60)


def test_what_is_measured_beside_a_curved_path_has_no_chords() -> None:
    path = np.column_stack([np.sin(20.0 * TIME), np.cos(20.0 * TIME), np.ones(60)])
    points = path + np.array([0.1, 0.2, 0.0])
    points[np.arange(60) % 4 > 0] = np.nan
    points[:, 2] = np.nan
    drawn = measured_path(TIME, points, path)
    np.testing.assert_allclose(drawn[:57] - path[:57], np.tile([0.1, 0.2, 0.0], (57, 1)), atol=1e-12)


CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


def test_a_body_is_drawn_by_the_edges_of_its_hull_without_diagonals_of_faces() -> None:
    edges = hull_edges(CUBE @ Rotation.from_euler("xyz", [0.3, 0.4, 0.5]).as_matrix().T)
    assert len(edges) == 12
    assert all(np.linalg.norm(CUBE[a] - CUBE[b]) == 1.0 for a, b in edges)


def test_a_flat_body_is_drawn_by_its_polygon_and_a_thin_one_by_a_segment() -> None:
    square = CUBE[CUBE[:, 2] == 1.0]
    assert hull_edges(np.vstack([square, [0.5, 0.5, 1.0]])) == [(0, 1), (0, 2), (1, 3), (2, 3)]
    assert hull_edges(np.array([[0.0, 1.0, 2.0], [0.0, 3.0, 2.0], [0.0, 2.0, 2.0]])) in ([(0, 1)], [(1, 0)])
    assert hull_edges(np.zeros((4, 3))) == []


def test_cables_of_a_body_end_at_its_attachments() -> None:
    attachments = np.broadcast_to(CUBE, (2, 8, 3)) + np.array([0.0, 1.0])[:, None, None]
    scene = RobotScene(np.arange(2.0), np.zeros((2, 3)), np.zeros((2, 8)), (), attachments=attachments)
    data = scene_data(scene)
    assert len(data["edges"]) == 12
    assert data["attachments"] == [pack_columns(attachments[:, cable]) for cable in range(8)]
    assert scene_data(RobotScene(np.arange(2.0), np.zeros((2, 3)), np.zeros((2, 8)), ()))["edges"] == []


def test_a_scene_has_fewer_frames_where_each_holds_more_and_both_ends() -> None:
    counts = [len(frame_indices(5000, 2, cables, has)) for cables, has in ((3, False), (12, False), (12, True))]
    assert counts[0] == 900 and counts[0] > counts[1] > counts[2] > 250
    frames = frame_indices(5000, 2, 12, True)
    assert (frames[0], frames[-1]) == (0, 4999)


def test_attachments_are_within_the_budget_of_a_scene() -> None:
    scene = robot_scene(suspended_robot(12), made_rigid_recording(suspended_robot(12), 4000))
    assert scene.attachments is not None
    drawn = [scene.time, scene.platform, scene.tension, scene.attachments, *(path.points for path in scene.paths)]
    assert sum(each.size for each in drawn) <= MAX_SCENE_NUMBERS
