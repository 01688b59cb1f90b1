"""Limits of a program where the user gives none, and the effects that a user names."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from ..tracer.hypotheses import Hypothesis, hypotheses
from .search import Limits

SPEED = 0.5
# Of the mean rope length, and of the static tensions.
REACH, LEAST, LARGEST = 0.05, 0.1, 3.0


def default_limits(robot: Robot, speed: float | None = None, reach: float | None = None) -> Limits:
    """What is not given: [winch] speed_limit or 0.5 m/s, a twentieth of the mean rope length, and [tension].

    Without [tension] a tenth of the least static tension to three times the largest.
    """
    tensions = static_tensions(robot)
    lengths = np.linalg.norm(np.array(robot.anchors) - np.array(robot.platform.start), axis=1)
    declared = robot.winch.speed_limit if robot.winch else None
    return Limits(
        speed=speed or declared or SPEED,
        reach=reach or REACH * float(np.mean(lengths)),
        least_tension=robot.tension.minimum if robot.tension else LEAST * float(np.min(tensions)),
        largest_tension=robot.tension.maximum if robot.tension else LARGEST * float(np.max(tensions)),
    )


def named_effects(robot: Robot, names: str | None) -> tuple[Hypothesis, ...]:
    """The hypotheses on all cables or the platform, of the effects that a list with commas names, or of all.

    Raises InputError for a name that is no effect, and for fewer than two.
    """
    every = [h for h in hypotheses(robot) if h.cables in ((), robot.cable_numbers)]
    if names is None:
        return tuple(every)
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    known = sorted({hypothesis.effect.name for hypothesis in every})
    for name in wanted:
        if name not in known:
            raise InputError("--effects", f"{name!r} is no effect on all cables", f"take from {', '.join(known)}")
    if len(set(wanted)) < 2:
        raise InputError("--effects", "fewer than two effects", "name two at least, such as damping,relaxation")
    return tuple(hypothesis for hypothesis in every if hypothesis.effect.name in wanted)
