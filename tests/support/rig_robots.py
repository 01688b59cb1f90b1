"""Robots and winches of the project as the rig declares them."""

from __future__ import annotations

from typing import Any

import numpy as np

from tautwire.robot.schema import Robot, Winch
from tests.rig import Drive, robot_from
from tests.rig import Robot as RigRobot

CORNERS = np.array([0.0, 1.0 / 0.3, 4.0, 7.0])
RAMP = np.array([0.3, 0.25, -0.25])


def rig_of(robot: Robot) -> RigRobot:
    """The same robot as the rig declares it."""
    content: dict[str, Any] = {
        "name": robot.name,
        "gravity": robot.gravity,
        "platform": {"mass": robot.platform.mass, "start": list(robot.platform.start)},
        "sensors": {},
        "cable": [
            {"anchor": list(c.anchor), "modulus": c.modulus, "area": c.area, "damping": c.damping, "law": c.law}
            for c in robot.cables
        ],
    }
    if robot.tension is not None:
        content["tension"] = vars(robot.tension)
    if robot.platform.is_rigid_body:
        content["platform"] |= {
            "inertia": robot.platform.inertia,
            "centre_of_mass": robot.platform.centre_of_mass,
            "start_orientation": robot.platform.start_orientation,
        }
        for entry, cable in zip(content["cable"], robot.cables, strict=True):
            entry["attachment"] = cable.attachment
    return robot_from(content)


def drive_of(winch: Winch) -> Drive:
    """The same winch as the rig declares it."""
    return Drive(
        radius=winch.drum_radius,
        gear=winch.gear,
        bandwidth=winch.bandwidth,
        damping_ratio=winch.damping_ratio,
        speed_limit=np.inf if winch.speed_limit is None else winch.speed_limit,
        acceleration_limit=np.inf if winch.acceleration_limit is None else winch.acceleration_limit,
    )
