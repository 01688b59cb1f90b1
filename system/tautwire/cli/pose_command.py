"""The command ``pose``: inverse kinematics and statics of a robot at a pose, or forward kinematics from lengths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..robot.robot_file_reader import read_robot
from ..robot.schema import Robot
from .console import (
    AsJson,
    CommandOutput,
    Quiet,
    RobotFile,
    command_provenance,
    parse_numbers,
    parse_position,
    parse_quaternion,
)

if TYPE_CHECKING:
    from ..robot.kinematics import ForwardSolution
    from ..robot.static_pose import StaticPose


def pose(
    context: typer.Context,
    robot_file: RobotFile,
    at: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Position, m; by default the start.")] = None,
    orientation: Annotated[
        str | None, typer.Option(metavar="W,X,Y,Z", help="Orientation of the platform; by default that of the file.")
    ] = None,
    rule: Annotated[
        str | None,
        typer.Option(help="Tension distribution: nearest (the default), least_norm, barycentre or closed_form."),
    ] = None,
    lengths: Annotated[
        str | None, typer.Option(metavar="L1,L2,...", help="Rope lengths, m: all poses near that one that have them.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute rope lengths, tensions and stiffness at a pose.

    With --lengths the other way round: the poses that ropes of these lengths lead to.

    Example: tautwire pose robot.toml --at 10,5.5,4 --rule least_norm
    """
    from ..robot.forward_statics import forward_kinematics_of_ropes
    from ..robot.static_pose import static_pose
    from ..robot.tension_distribution import RULES

    if rule is not None and rule not in RULES:
        raise InputError("--rule", f"{rule!r} is no rule", f"give one of {', '.join(RULES)}")
    if rule is not None and lengths is not None:
        raise InputError("--rule", "is given with --lengths, which lead to poses without it", "omit one of them")
    output, robot = CommandOutput(as_json, quiet), read_robot(robot_file)
    position = None if at is None else parse_position(at)
    quaternion = None if orientation is None else parse_quaternion(orientation)
    provenance = {"provenance": command_provenance(context, robot_file).document()}
    if lengths is None:
        rule = rule or "nearest"
        held = static_pose(robot, position, quaternion, rule)
        output.result(_pose_lines(robot, held), {**_pose_document(held), "rule": rule, **provenance})
        return
    wanted = parse_numbers(lengths, robot.cable_count, "--lengths", "9.1,9.3,9.2, one for each cable")
    found = forward_kinematics_of_ropes(robot, wanted, position, quaternion)
    lines = [f"pose {number}: {_solution_line(robot, each)}" for number, each in enumerate(found, 1)]
    output.result(lines or ["no pose near that one has these lengths"], {"poses": _solutions(found), **provenance})


def _pose_lines(robot: Robot, held: StaticPose) -> list[str]:
    import numpy as np

    lines = [f"position {_listed(held.position, 6)} m"]
    if robot.platform.is_rigid_body:
        lines.append(f"orientation {_listed(held.orientation, 6)}")
    pairs = zip(held.lengths, held.tensions, strict=True)
    lines += [f"cable {i}: {length:.6f} m, {tension:.6g} N" for i, (length, tension) in enumerate(pairs, 1)]
    stiffness = np.linalg.eigvalsh(0.5 * (held.stiffness + held.stiffness.T)[:3, :3])
    lines.append(f"stiffness against displacement {', '.join(f'{value:.4g}' for value in stiffness)} N/m")
    if held.wrench_margin is not None:
        lines.append(f"wrench margin {held.wrench_margin:.4g} N")
    return lines


def _pose_document(held: StaticPose) -> dict[str, Any]:
    return {
        "position": held.position,
        "orientation": held.orientation,
        "lengths": held.lengths.tolist(),
        "tensions": held.tensions.tolist(),
        "structure_matrix": held.structure_matrix.tolist(),
        "stiffness_matrix": held.stiffness.tolist(),
        "wrench_margin": held.wrench_margin,
    }


def _solution_line(robot: Robot, solution: ForwardSolution) -> str:
    turned = f", orientation {_listed(solution.orientation, 6)}" if robot.platform.is_rigid_body else ""
    return f"position {_listed(solution.position, 6)} m{turned}, residual {solution.residual:.3g} m"


def _solutions(found: Sequence[ForwardSolution]) -> list[dict[str, Any]]:
    return [{"position": each.position, "orientation": each.orientation, "residual": each.residual} for each in found]


def _listed(values: Sequence[float], decimals: int) -> str:
    return ", ".join(f"{value + 0.0:.{decimals}f}" for value in values)
