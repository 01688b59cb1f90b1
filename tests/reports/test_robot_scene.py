"""The scene draws what was measured beside another path by its deviation from that."""

from __future__ import annotations

import numpy as np

from tautwire.reports.robot_scene import measured_path

TIME = 0.02 * np.arange(60)


def test_what_is_measured_beside_a_curved_path_has_no_chords() -> None:
    path = np.column_stack([np.sin(20.0 * TIME), np.cos(20.0 * TIME), np.ones(60)])
    points = path + np.array([0.1, 0.2, 0.0])
    points[np.arange(60) % 4 > 0] = np.nan
    points[:, 2] = np.nan
    drawn = measured_path(TIME, points, path)
    np.testing.assert_allclose(drawn[:57] - path[:57], np.tile([0.1, 0.2, 0.0], (57, 1)), atol=1e-12)
