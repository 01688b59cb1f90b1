"""Notes on the controllers that a campaign designs."""

from __future__ import annotations

from dataclasses import replace

from ..control import Controller, ScheduledController
from ..robot.robot_file_reader import robot_from_content
from .campaign_plan import Plan
from .campaign_run import at_path_start, designed_controller, path_trajectory

# Feedforward closes no loop, and robust designs keep far larger margins by construction.
NOTED_CONTROLLERS = ("lqg", "scheduled")


def with_controller_notes(plan: Plan) -> Plan:
    """The plan with the notes of the LQG controllers and schedules of the declared robot, which tell of small margins.

    Raises what designs of controllers raise.
    """
    notes: list[str] = []
    for path_index, controller in plan.variants:
        if controller not in NOTED_CONTROLLERS:
            continue
        path = plan.paths[path_index]
        robot = at_path_start(robot_from_content(dict(plan.content), plan.file), path)
        design = designed_controller(robot, path_trajectory(robot, path), controller)
        if isinstance(design, Controller | ScheduledController):
            notes += [f"{path.name}, {controller}: {note}" for note in design.notes]
    return replace(plan, notes=(*plan.notes, *notes))
