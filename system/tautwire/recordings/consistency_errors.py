"""Errors of a recording that does not fit its robot: what shows it, the likely cause, and what mends it."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import RecordingError
from ..robot.schema import Robot
from .alternative_readings import mistakes_text
from .anchor_scale import AnchorScale
from .mistaken_motion import MotionCheck
from .mistaken_points import PointMistake
from .mistaken_tensions import TensionCheck
from .odd_winches import OddWinch
from .recording import Recording


def motion_error(robot: Robot, recording: Recording, motion: MotionCheck) -> RecordingError:
    """The error of readings of the columns that explain winch travel better."""
    shown = "poses" if robot.platform.is_rigid_body else "positions"
    causes, remedies = mistakes_text([reading.mistakes for reading in motion.readings], recording)
    problem = (
        f"winch travel does not match the {shown}: it is off by {_percentage(motion.misfit)}, by "
        f"{_percentage(motion.readings[0].misfit)} if {causes}"
    )
    return RecordingError(recording.path, problem, remedies)


def point_error(recording: Recording, motion: MotionCheck, points: PointMistake) -> RecordingError:
    """The error of points of a rigid platform that are elsewhere."""
    off = f"it is off by {_percentage(motion.misfit)}, by {_percentage(points.misfit)} if {points.cause}"
    return RecordingError(recording.path, f"winch travel does not match the poses: {off}", points.remedy)


def odd_winch_error(recording: Recording, odd: OddWinch) -> RecordingError:
    """The error of one winch's travel."""
    off = f"it is off by {_percentage(odd.misfit)}, and {odd.cause}"
    problem = f"winch travel of cable {odd.cable} does not match the positions: {off}"
    return RecordingError(recording.path, problem, odd.remedy)


def tension_error(recording: Recording, tensions: TensionCheck) -> RecordingError:
    """The error of load cells that are read otherwise."""
    causes, remedies = mistakes_text(tensions.mistakes, recording)
    problem = (
        f"tensions do not match the platform's weight: they carry {_percentage(tensions.carried)} of it and are off by "
        f"{_percentage(tensions.misfit)}, by {_percentage(tensions.corrected_misfit)} if {causes}"
    )
    return RecordingError(recording.path, problem, remedies)


def cable_order_error(errors: Sequence[RecordingError], order: Sequence[int]) -> RecordingError:
    """The error of winches and load cells in one other order, which the robot file's cables may have instead."""
    tables = ", ".join(str(order.index(column) + 1) for column in range(len(order)))
    problem, hint = ("; ".join(texts) for texts in zip(*((e.problem, e.hint) for e in errors), strict=True))
    instead = f"write the [[cable]] tables of the robot file in the order {tables}, as winches and load cells both say"
    return RecordingError(errors[0].where, problem, f"{instead}; or else {hint}")


def hopeless_tension_error(recording: Recording, tensions: TensionCheck) -> RecordingError:
    """The error of load cells that carry nothing of the weight, or far more, for no cause that is known."""
    problem = (
        f"tensions do not match the platform's weight: they carry {_percentage(tensions.carried)} of it, and no unit, "
        "sign, order, zero or gain that was tried explains it"
    )
    hint = (
        "compare each load cell with its calibration, platform.mass (kg) and the anchors, and see whether a spring, a "
        "counterweight or a guide carries the platform; or leave the tensions out"
    )
    return RecordingError(recording.path, problem, hint)


def anchor_error(recording: Recording, scale: AnchorScale) -> RecordingError:
    """The error of exit points or attachments that are all off by one factor."""
    problem = (
        f"winch travel does not match the positions: it is off by {_percentage(scale.misfit)}, by "
        f"{_percentage(scale.misfit_left)} if all {scale.key}s in the robot file are {scale.factor:.3g} times the true "
        "ones"
    )
    hint = f"write the {scale.key}s as surveyed, in m; multiplied by {1.0 / scale.factor:.3g} they fit"
    return RecordingError(recording.path, problem, hint)


def unexplained_error(recording: Recording, motion: MotionCheck) -> RecordingError:
    """The error of winch travel that explains nothing of the positions, as it is read or in another way."""
    problem = (
        f"winch travel does not match the positions: it is off by {_percentage(motion.misfit)} of the ropes' motion, "
        "more than winches that stand would be, and no unit, sign, order, frame or clock that was tried explains it"
    )
    hint = (
        "compare one column after the other with the robot: are winches, positions and robot file of one run and one "
        "robot, and is more than one of units, signs and anchors wrong?"
    )
    return RecordingError(recording.path, problem, hint)


def _percentage(share: float) -> str:
    return f"{100.0 * share:,.0f} %" if abs(share) >= 0.1 else f"{100.0 * share:.2g} %"
