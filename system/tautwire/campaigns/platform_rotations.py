"""Orientations of a campaign's runs as rotations about the world's axes, from the declared start of each path.

Components of a quaternion mean nothing one by one, so summary and page have rotation vectors in rad; rows and series
keep the quaternions.
"""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..recordings.quaternion_columns import rotation_vectors
from ..robot.robot_file_reader import robot_from_content
from ..robot.schema import AXES, Quaternion
from .campaign_plan import Plan
from .dataset_schema import ORIENTATION_COLUMNS, RowColumn, series_columns
from .reference_input import at_path_start

Array = NDArray[np.float64]

ROTATION_CHANNELS = tuple(f"rotation_{axis}" for axis in AXES)


def summary_channels(plan: Plan, cable_count: int) -> tuple[str, ...]:
    """Time series that are summarised: those of the dataset with rotations in place of the quaternion."""
    others = series_columns(cable_count)
    return (*AXES, *ROTATION_CHANNELS, *others[len(AXES) :]) if plan.is_rigid else others


def start_orientations(plan: Plan) -> dict[str, Quaternion]:
    """The orientation in which the declared robot starts each path, by the path's name."""
    robot = robot_from_content(dict(plan.content), plan.file)
    return {path.name: at_path_start(robot, path).platform.start_orientation for path in plan.paths}


def with_end_rotations(plan: Plan, columns: tuple[RowColumn, ...], rows: pa.Table) -> tuple[list[RowColumn], pa.Table]:
    """Columns and rows with ``end_rotation_x`` ... in rad in place of the quaternion at the end of a run."""
    quaternion_names = [f"end_{part}" for part in ORIENTATION_COLUMNS]
    if quaternion_names[0] not in rows.column_names:
        return list(columns), rows
    quaternions = np.stack([rows[name].cast(pa.float64()).to_numpy() for name in quaternion_names], axis=1)
    paths, rotations = np.array(rows["path"].to_pylist()), np.full((len(quaternions), len(AXES)), np.nan)
    for path, start in start_orientations(plan).items():
        rotations[paths == path] = rotation_vectors(quaternions[paths == path], start)
    place = [column.name for column in columns].index(quaternion_names[0])
    added = [RowColumn(f"end_{name}", "number", "rad") for name in ROTATION_CHANNELS]
    for column, values in zip(added, rotations.T, strict=True):
        rows = rows.append_column(column.name, pa.array(values))
    return [*columns[:place], *added, *columns[place + len(ORIENTATION_COLUMNS) :]], rows
