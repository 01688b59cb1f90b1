"""Notes on the controllers that a campaign designs."""

from __future__ import annotations

from dataclasses import replace

from ..control import Controller, ScheduledController
from ..control.reachable_plant import reach_notes, reachable_plant
from ..linear import linearise
from ..robot.robot_file_reader import robot_from_content
from ..robot.schema import Robot
from .campaign_plan import PathPlan, Plan
from .reference_input import at_path_start, designed_controller, path_trajectory


def with_controller_notes(plan: Plan) -> Plan:
    """The plan with the notes of the feedback controllers of the declared robot, by path and controller.

    Raises what designs of controllers raise.
    """
    notes: list[str] = []
    for path_index, controller in plan.variants:
        if controller in ("lqg", "scheduled", "robust"):
            path = plan.paths[path_index]
            robot = at_path_start(robot_from_content(dict(plan.content), plan.file), path)
            notes += [f"{path.name}, {controller}: {note}" for note in _notes(robot, path, controller)]
    return replace(plan, notes=(*plan.notes, *notes))


def _notes(robot: Robot, path: PathPlan, controller: str) -> tuple[str, ...]:
    # A robust design takes up to a minute, and keeps larger margins than are noted.
    if controller == "robust":
        return reach_notes(reachable_plant(linearise(robot, swing=0.0)))
    design = designed_controller(robot, path_trajectory(robot, path), controller)
    return design.notes if isinstance(design, Controller | ScheduledController) else ()
