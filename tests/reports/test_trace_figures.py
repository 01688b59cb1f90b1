"""The figures of a trace's page: the scene of a rigid platform."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.reports.downsampling import unpack_float32
from tautwire.reports.robot_scene import MAX_SCENE_NUMBERS
from tautwire.reports.trace_figures import trace_page_data
from tests.support.pose_recordings import rotation_of
from tests.support.rigid_robots import crane_robot, suspended_robot
from tests.support.rigid_runs import made_rigid_trace


def test_cables_of_a_rigid_platform_end_at_its_attachments_in_the_pose_of_the_extended_model() -> None:
    trace = made_rigid_trace(crane_robot(), 40)
    (comparison,) = trace.comparisons
    still = np.tile([1.0, 0.0, 0.0, 0.0], (40, 1))
    measured = replace(comparison.recording, orientation=still)
    elsewhere = replace(comparison, recording=measured, before=replace(comparison.before, orientation=still))
    scene = trace_page_data(replace(trace, comparisons=(elsewhere,)))["choices"][0]["scene"]
    assert len(scene["attachments"]) == 8 and scene["edges"]
    drawn = np.array([unpack_float32(column) for column in scene["attachments"][2]]).T
    arms = rotation_of(comparison.after.orientation).apply(crane_robot().attachments[2])
    assert drawn == pytest.approx(comparison.after.position + arms, rel=1e-5)


def test_attachments_are_within_the_budget_of_a_scene() -> None:
    scene = trace_page_data(made_rigid_trace(suspended_robot(12), 2000))["choices"][0]["scene"]
    columns = [scene["time"], *scene["platform"], *scene["tension"], *scene["measuredTension"]]
    columns += [column for path in scene["paths"] for column in path["columns"]]
    columns += [column for point in scene["attachments"] for column in point]
    assert len(scene["attachments"]) == 12
    assert sum(unpack_float32(column).size for column in columns) <= MAX_SCENE_NUMBERS
