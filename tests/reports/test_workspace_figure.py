from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from tautwire.errors import InputError
from tautwire.reports.workspace_figure import require_figure_format, workspace_figure
from tautwire.robot.pose_grid import orientation_grid
from tautwire.robot.workspace import workspace_on, wrench_feasible_workspace
from tests.support.rigid_robots import crane_robot
from tests.support.robots import example


@pytest.mark.validate
def test_three_slices_through_the_start_show_the_margin() -> None:
    robot = example("caroca")
    workspace = wrench_feasible_workspace(robot, spacing=0.5)
    figure = workspace_figure(robot, workspace)
    titles = [axes.get_title() for axes in figure.axes[:3]]
    assert titles == ["z = 1 m", "y = 0 m", "x = 1 m"]
    level = int(np.argmin(np.abs(workspace.axes[2] - 1.0)))
    expected = np.where(workspace.feasible, workspace.margin, np.nan)[:, :, level].T
    shown = np.ma.filled(figure.axes[0].collections[0].get_array(), np.nan)
    assert np.array_equal(shown.reshape(expected.shape), expected, equal_nan=True)
    picture = BytesIO()
    figure.savefig(picture)
    assert len(picture.getvalue()) > 10_000


def test_a_workspace_without_a_feasible_position_is_drawn_too() -> None:
    robot = example("caroca")
    workspace = wrench_feasible_workspace(robot, (3.0, 3.0, 1.0), (5.0, 5.0, 2.0), 1.0)
    assert not workspace.feasible.any()
    workspace_figure(robot, workspace).savefig(BytesIO())


def test_slices_of_orientations_are_hatched_where_cables_touch() -> None:
    robot = crane_robot()
    workspace = workspace_on(orientation_grid(robot, (0.6, 0.0, 1.2), spacing=0.6), robot, "static")
    figure = workspace_figure(robot, workspace)
    panel = figure.axes[1]
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("rotation about x, rad", "rotation about z, rad")
    assert workspace.interference is not None
    touching = workspace.interference[0] | workspace.interference[1]
    assert len(panel.patches) == touching.sum() > 0
    assert "Static workspace of crane (hatched" in figure.get_suptitle()


def test_a_file_without_a_figures_suffix_is_refused() -> None:
    require_figure_format(Path("a.PDF"))
    with pytest.raises(InputError, match=r"b\.csv: has no suffix of a figure"):
        require_figure_format(Path("b.csv"))
