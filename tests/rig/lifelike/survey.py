"""How well a robot's owner knows it: uncertainties that the robot file states, and a true robot within them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.rig.lifelike.design import Design
from tests.rig.robot import Body, Robot, Vector

# Nothing is off by more than this many of its standard deviations.
FURTHEST = 2.0


@dataclass(frozen=True)
class Survey:
    """Standard deviations: points and tracker's zero in m, tensions in N, all others relative.

    Those of a platform that turns are zero for a point mass; that of its principal moments is relative to their mean.
    """

    anchor: float
    mass: float
    modulus: float
    damping: float
    tension_gain: float
    tension_offset: float
    position_offset: float
    preferred: float
    attachment: float = 0.0
    centre: float = 0.0
    inertia: float = 0.0


NOTHING_UNKNOWN = Survey(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Truth:
    """The robot as it is, and its sensors' gains (n), zeros (n) in N, and tracker's zero (3) in m."""

    robot: Robot
    gain: Vector
    offset: Vector
    position: Vector

    def document(self, declared: Robot) -> dict[str, Any]:
        """By how much everything is off."""
        turning: dict[str, Any] = {}
        if self.robot.body is not None and declared.body is not None:
            turning = {
                "attachment": (self.robot.body.attachments - declared.body.attachments).tolist(),
                "centre_of_mass": (self.robot.body.centre - declared.body.centre).tolist(),
                "inertia": (self.robot.body.inertia - declared.body.inertia).tolist(),
            }
        return {
            **turning,
            "anchor": (self.robot.anchors - declared.anchors).tolist(),
            "mass": self.robot.mass / declared.mass,
            "modulus": (self.robot.modulus / declared.modulus).tolist(),
            "damping": (self.robot.damping / declared.damping).tolist(),
            "gain": self.gain.tolist(),
            "offset": self.offset.tolist(),
            "position": self.position.tolist(),
        }


def survey_of(random: np.random.Generator, design: Design) -> Survey:
    """What is known of a design, by lot about what is usual for its size."""
    size, lots = design.width**0.5, np.exp(random.normal(scale=0.3, size=8))
    usual = design.usual_tension
    turning = {}
    if design.robot.body is not None:
        more = np.exp(random.normal(scale=0.3, size=3))
        turning = {
            "attachment": _short(2e-4 * size * more[0]),
            "centre": _short(0.02 * design.size * more[1]),
            "inertia": _short(0.03 * more[2]),
        }
    return Survey(
        **turning,
        anchor=_short(4e-4 * size * lots[0]),
        mass=_short(0.003 * lots[1] * design.robot.mass) / design.robot.mass,
        modulus=_short(0.01 * lots[2]),
        damping=_short(0.15 * lots[3]),
        tension_gain=_short(0.004 * lots[4]),
        tension_offset=_short(2.5e-3 * usual * lots[5]),
        position_offset=_short(2e-4 * size * lots[6]),
        preferred=_short(0.03 * usual * lots[7]),
    )


def true_robot(random: np.random.Generator, design: Design, survey: Survey) -> Truth:
    """One of the robots that the survey could have met; anchors of a planar robot stay in its plane."""
    robot, count = design.robot, design.robot.count

    def off(shape: int | tuple[int, ...], deviation: float) -> Vector:
        return deviation * np.clip(random.normal(size=shape), -FURTHEST, FURTHEST)

    moved = off((count, 3), survey.anchor)
    if design.planar:
        moved[:, 1] = 0.0
    preferred = robot.tension.preferred + off(count, survey.preferred)
    made = replace(
        robot,
        anchors=robot.anchors + moved,
        mass=robot.mass * float(1.0 + off(1, survey.mass)[0]),
        modulus=robot.modulus * (1.0 + off(count, survey.modulus)),
        # One batch of rope: the dampings differ little from each other.
        damping=robot.damping * (1.0 + off(1, survey.damping) + off(count, 0.1 * survey.damping)),
        tension=replace(robot.tension, preferred=preferred),
    )
    if made.body is not None:
        moments, axes = np.linalg.eigh(made.body.inertia)
        moments = moments + off(3, survey.inertia * float(moments.mean()))
        body = replace(
            made.body,
            attachments=made.body.attachments + off((count, 3), survey.attachment),
            centre=made.body.centre + off(3, survey.centre),
            inertia=(axes * moments) @ axes.T,
        )
        made = replace(made, body=body)
    return Truth(
        made, 1.0 + off(count, survey.tension_gain), off(count, survey.tension_offset), off(3, survey.position_offset)
    )


def robot_file(design: Design, survey: Survey, name: str) -> str:
    """The robot as its owner declares it."""
    robot = design.robot
    lines = [f'name = "{name}"', f"gravity = {robot.gravity}", "", "[platform]", f"mass = {robot.mass}"]
    lines += [f"mass_uncertainty = {survey.mass * robot.mass:.3g}", f"start = {robot.start.tolist()}"]
    lines += [*_body_lines(robot.body, survey), ""]
    if robot.count > (6 if robot.body else 3) or design.planar:
        limits = robot.tension
        lines += ["[tension]", f"minimum = {limits.minimum:.4g}", f"maximum = {limits.maximum:.4g}"]
        lines += [f"preferred = {limits.preferred}", f"preferred_uncertainty = {survey.preferred}", ""]
    noise = robot.noise
    lines += ["[sensors]", f"position_noise = {noise.position}", f"tension_noise = {noise.tension}"]
    lines += [f"winch_speed_noise = {noise.winch_speed}", f"tension_offset_uncertainty = {survey.tension_offset}"]
    lines += [f"tension_gain_uncertainty = {survey.tension_gain}"]
    lines += [f"position_offset_uncertainty = {survey.position_offset}"]
    lines += [f"orientation_noise = {noise.orientation}"] if robot.body else []
    columns = zip(robot.anchors, robot.modulus, robot.area, robot.damping, strict=True)
    for index, (anchor, modulus, area, damping) in enumerate(columns):
        lines += ["", "[[cable]]", f"anchor = {anchor.tolist()}", f"anchor_uncertainty = {survey.anchor}"]
        if robot.body:
            lines += [f"attachment = {robot.body.attachments[index].tolist()}"]
            lines += [f"attachment_uncertainty = {survey.attachment}"]
        lines += [f"modulus = {modulus:.6g}", f"modulus_uncertainty = {survey.modulus * modulus:.4g}"]
        lines += [f"area = {area}", f"damping = {damping:.6g}"]
        lines += [f"damping_uncertainty = {survey.damping * damping:.4g}", 'law = "logarithmic"']
    return "\n".join(lines) + "\n"


def _body_lines(body: Body | None, survey: Survey) -> list[str]:
    """What the table [platform] says of one that turns."""
    if body is None:
        return []
    x, y, z, w = Rotation.from_matrix(body.orientation).as_quat().tolist()
    moments = np.linalg.eigvalsh(body.inertia)
    return [
        f"inertia = {body.inertia.tolist()}",
        f"inertia_uncertainty = {survey.inertia * moments.mean():.3g}",
        f"centre_of_mass = {body.centre.tolist()}",
        f"centre_of_mass_uncertainty = {survey.centre}",
        f"start_orientation = {[w, x, y, z]}",
    ]


def _short(value: float) -> float:
    return float(f"{value:.2g}")
