"""Data of a controller on a path, as plain numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.sampled_control import Limits
from tautwire_fmu.laws.winch_drive import NO_LIMIT

from ..errors import InputError
from ..robots.robot import Robot
from .design import Design, Knot
from .path import Reference

Array = NDArray[np.float64]


def controller_data(robot: Robot, design: Design, reference: Reference) -> dict[str, Any]:
    """The content of a controller's resource: lists and numbers, as the law of the FMU takes them.

    Raises InputError where a regulator acts on position or tension without a sample of delay.
    """
    period = design.aim.period
    return {
        "description": f"controller of {robot.name}",
        "period": period,
        "speeds": reference.rigid.tolist(),
        "stretches": (reference.speeds - reference.rigid).tolist(),
        "expected": reference.expected.tolist(),
        "at_rest": reference.at_rest.tolist(),
        "knots": [_knot_data(knot, period) for knot in design.knots()],
        "compliances": cable_compliances(robot).tolist(),
        "yield_time": design.aim.yield_time,
        "tares": design.feels and design.aim.tare,
        "limits": control_limits(robot, design)._asdict(),
    }


def control_limits(robot: Robot, design: Design) -> Limits:
    """The tighter limits of aim and robot file; no tension limits without feedback."""
    aim, winch, bounds = design.aim, robot.winch, robot.tension
    speed = [aim.speed_limit, winch.speed_limit if winch else None]
    acceleration = [aim.acceleration_limit, winch.acceleration_limit if winch else None]
    lowest = next(x for x in (aim.lowest_tension, bounds.minimum if bounds else None, 0.0) if x is not None)
    highest = next(x for x in (aim.highest_tension, bounds.maximum if bounds else None, NO_LIMIT) if x is not None)
    return Limits(
        speed=min(NO_LIMIT, *(value for value in speed if value is not None)),
        acceleration=min(NO_LIMIT, *(value for value in acceleration if value is not None)),
        lowest_tension=lowest if design.feels else -NO_LIMIT,
        highest_tension=min(highest, NO_LIMIT) if design.feels else NO_LIMIT,
    )


def cable_compliances(robot: Robot) -> Array:
    """Compliance of each cable at the start, ``l / (E S)``, shape (n,), in m/N."""
    lengths = np.linalg.norm(np.array(robot.anchors) - robot.platform.start, axis=1)
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    result: Array = lengths / stiffness
    return result


def _knot_data(knot: Knot, period: float) -> dict[str, Any]:
    regulator = knot.regulator
    sensors = regulator.ninputs - regulator.noutputs
    if np.any(regulator.D[:, :sensors]):
        hint = "give it one sample for computing: no direct gain from position or tension"
        raise InputError(regulator.name, "acts on the sample just measured", hint)
    return {
        "sample": knot.time / period,
        "A": regulator.A.tolist(),
        "B": regulator.B.tolist(),
        "C": regulator.C.tolist(),
        "D": regulator.D[:, sensors:].tolist(),
        "M": knot.tracking.tolist(),
    }
