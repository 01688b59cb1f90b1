"""Default limits of an excitation, and the effects that a user names."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from ..tracer.hypotheses import Hypothesis, hypotheses
from .search import ExcitationLimits

DEFAULT_SPEED_LIMIT = 0.5
# Shares of the mean rope length, of the smallest and of the largest static tension.
DEFAULT_REACH_RATIO, MIN_TENSION_RATIO, MAX_TENSION_RATIO = 0.05, 0.1, 3.0


def default_limits(robot: Robot, speed: float | None = None, reach: float | None = None) -> ExcitationLimits:
    """Default limits: [winch] speed_limit or 0.5 m/s, a twentieth of the mean rope length, and [tension].

    Without [tension] a tenth of the least static tension to three times the largest.
    """
    tensions = static_tensions(robot)
    lengths = np.linalg.norm(np.array(robot.anchors) - np.array(robot.platform.start), axis=1)
    declared_speed = robot.winch.speed_limit if robot.winch else None
    return ExcitationLimits(
        speed=speed or declared_speed or DEFAULT_SPEED_LIMIT,
        reach=reach or DEFAULT_REACH_RATIO * float(np.mean(lengths)),
        min_tension=robot.tension.minimum if robot.tension else MIN_TENSION_RATIO * float(np.min(tensions)),
        max_tension=robot.tension.maximum if robot.tension else MAX_TENSION_RATIO * float(np.max(tensions)),
    )


def effects_by_name(robot: Robot, names: str | None) -> tuple[Hypothesis, ...]:
    """The hypotheses on all cables or the platform, of the effects that a list with commas names, or of all.

    Raises InputError for a name that is no effect, and for fewer than two.
    """
    candidates = [h for h in hypotheses(robot) if h.cables in ((), robot.cable_numbers)]
    if names is None:
        return tuple(candidates)
    requested = [name.strip() for name in names.split(",") if name.strip()]
    available = sorted({hypothesis.effect.name for hypothesis in candidates})
    for name in requested:
        if name not in available:
            raise InputError("--effects", f"{name!r} is no effect on all cables", f"take from {', '.join(available)}")
    if len(set(requested)) < 2:
        raise InputError("--effects", "fewer than two effects", "name two at least, such as damping,relaxation")
    return tuple(hypothesis for hypothesis in candidates if hypothesis.effect.name in requested)
