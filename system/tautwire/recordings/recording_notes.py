"""What kinematics and statics of a recording say that no mistake in its columns explains, as notes of a check."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .consistency import EFFECTS_ON_FORCES, EFFECTS_ON_POSES
from .load_cell_scale import LoadCellScale, load_cell_scale
from .mistaken_motion import check_motion
from .motion_regression import length_regression
from .position_lag import PositionLag, position_lag
from .recording import Recording
from .unwound_motion import unwound_motion_text
from .winch_drift import winch_drifts
from .winch_scales import WinchScale, winch_scales

# Of lifelike recordings the ropes' motion and the winch travel differ by less.
MAX_USUAL_MISFIT = 0.15
# Of winches whose times are wrong: lifelike robots' scales then differ by up to 1.3 %.
MAX_CLOCK_SPREAD = 0.015


def recording_notes(robot: Robot, recording: Recording) -> tuple[str, ...]:
    """Notes on a lag of the positions, the scale of each winch and that of all load cells, which effects explain.

    Where neither lag nor scales are told, on winches that drift; without any of these, on winch travel and poses that
    differ by more than effects usually make them. Robots that declare effects of the kind are not judged.
    """
    declared = {setting.name for setting in robot.effects}
    lag, scales = _lag_and_scales(robot, recording)
    notes = [_lag_text(lag)] if lag else []
    notes += [f"{_scales_text(scales)}: {_drums_text(recording, scales)}"] if scales else []
    notes += [] if notes else _drift_texts(robot, recording)
    if not (notes or declared & EFFECTS_ON_POSES):
        unwound = unwound_motion_text(robot, recording)
        notes += [unwound] if unwound else _unexplained_travel(robot, recording)
    if not (robot.formulas or declared & EFFECTS_ON_FORCES):
        scale = load_cell_scale(robot, recording)
        notes += [_load_cell_text(scale)] if scale else []
    return tuple(f"{recording.path}: {note}" for note in notes)


def kinematic_scale_notes(robot: Robot, recording: Recording) -> tuple[str, ...]:
    """A note on the scale of each winch by kinematics alone, to stand beside what a trace says of drums.

    Kinematics know nothing of ropes that stretch: the scales are of what the platform moved, not of what was unwound.
    """
    scales = kinematic_scales(robot, recording)
    return (f"{recording.path}: by kinematics alone {_scales_text(scales)}",) if scales else ()


def drift_notes(robot: Robot, recording: Recording) -> tuple[str, ...]:
    """Notes on winches that drift, to stand beside what a trace says of ropes that lengthen by themselves."""
    return tuple(f"{recording.path}: {text}" for text in _drift_texts(robot, recording))


def kinematic_scales(robot: Robot, recording: Recording) -> tuple[WinchScale, ...]:
    """The scales of winches by kinematics alone; none where the robot declares an effect that changes lengths."""
    return _lag_and_scales(robot, recording)[1]


def _lag_and_scales(robot: Robot, recording: Recording) -> tuple[PositionLag | None, tuple[WinchScale, ...]]:
    declared = {setting.name for setting in robot.effects}
    if declared & EFFECTS_ON_POSES:
        return None, ()
    lag = position_lag(robot, recording)
    return lag, () if "drum" in declared else winch_scales(robot, recording, lag.seconds if lag else 0.0)


def _lag_text(lag: PositionLag) -> str:
    direction, traced = "ahead of", "trace corrects the clock"
    if lag.seconds > 0.0:
        direction, traced = (
            "behind",
            "trace tells it as sensor_delay, or corrects the clock where it is in one recording",
        )
    return (
        f"positions are {abs(lag.seconds):.3f} s (+- {2.0 * lag.deviation:.1g}) {direction} the winches: without that, "
        f"rope lengths miss winch travel by {1e3 * lag.rms_after:.2g} mm, not {1e3 * lag.rms_before:.2g} mm; {traced}"
    )


def _scales_text(scales: tuple[WinchScale, ...]) -> str:
    cables = [scale.cable for scale in scales]
    factors = ", ".join(f"{scale.factor:.3f}" for scale in scales)
    deviation = 2.0 * max(scale.deviation for scale in scales)
    several = f"winches {', '.join(map(str, cables[:-1]))} and {cables[-1]}"
    winches = f"winch {cables[0]}" if len(cables) == 1 else several
    return f"rope moves {factors} (+- {max(deviation, 1e-3):.1g}) of what {winches} wound"


def _drift_texts(robot: Robot, recording: Recording) -> list[str]:
    if {setting.name for setting in robot.effects} & EFFECTS_ON_POSES:
        return []
    return [
        f"rope {drift.cable} {'lengthens' if drift.rate > 0.0 else 'shortens'} steadily by {1e3 * abs(drift.rate):.3g} "
        f"mm/s beside what winch {drift.cable} wound, as with an offset of {drift.rate:.3g} m/s in "
        f"winch_speed_{drift.cable} (offset in [recording.columns] takes it out), or a rope that creeps"
        for drift in winch_drifts(robot, recording)
    ]


def _drums_text(recording: Recording, scales: tuple[WinchScale, ...]) -> str:
    drums = "a drum" if len(scales) == 1 else "drums"
    factors = [scale.factor for scale in scales]
    is_of_all = len(factors) == recording.cable_count and np.ptp(factors) <= MAX_CLOCK_SPREAD * np.mean(factors)
    clock = ", or times in another interval" if is_of_all and not recording.rope_lengths else ""
    return f"{drums} of another radius than declared, or another factor of counts{clock}; trace tells it as drum"


def _load_cell_text(scale: LoadCellScale) -> str:
    causes = [] if scale.gain is None else [f"a gain of all load cells of {scale.gain:.3g} (sensor_gain)"]
    if scale.offset is not None:
        causes.append(f"an offset of all load cells of {scale.offset:.3g} N (sensor_offset)")
    if scale.payload is not None:
        causes.append(f"a payload of {scale.payload:.3g} kg (payload)")
    causes = causes or ["no unit, sign, order, zero or gain that was tried explains it; compare the load cells"]
    apart = ", which statics alone cannot tell apart" if len(causes) > 1 else ""
    return (
        f"tensions carry {100.0 * scale.carried:.1f} % (+- {200.0 * scale.deviation:.1g}) of the platform's "
        f"weight: {' or '.join(causes)}{apart}, unless pulleys or sag that the robot file lacks turn the ropes"
    )


def _unexplained_travel(robot: Robot, recording: Recording) -> list[str]:
    if _is_constant(recording.position) or _is_constant(recording.orientation):
        return []
    motion, regression = check_motion(robot, recording), length_regression(robot, recording)
    if motion is None or regression is None or not MAX_USUAL_MISFIT < motion.misfit < np.inf:
        return []
    cable = int(np.argmax(regression.misfits)) + 1
    return [
        f"winch travel is off the recorded positions by {100.0 * motion.misfit:.0f} % of the ropes' motion, that of "
        f"cable {cable} most, and no unit, sign, order or frame that was tried explains it; ropes and drums usually "
        f"leave less than {100.0 * MAX_USUAL_MISFIT:.0f} %: compare exit points and encoders"
    ]


def _is_constant(values: NDArray[np.float64]) -> bool:
    """Whether what was measured of positions or quaternions (N, k) is one value, as of a sensor that is dead."""
    measured = values[np.isfinite(values).all(axis=1)]
    return bool(len(measured) and not np.ptp(measured, axis=0).any())
