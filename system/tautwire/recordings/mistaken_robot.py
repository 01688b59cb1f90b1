"""Numbers of a robot file that a recording contradicts: the stiffness of its ropes, and the noise of its sensors.

A trace estimates either, and so takes such a file; a check tells the line that is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import RobotFileError
from ..robot.schema import Robot
from .consistency import EFFECTS_ON_FORCES
from .load_cell_scale import MAX_UNEXPLAINED, load_cell_scale
from .recording import Recording
from .rope_compliance import is_other_rope, rope_compliance
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

# Factors of the units in which a deviation was probably stated; what is seen is a share to a multiple of it, by jolts.
NOISE_UNITS = {"position_noise": {"mm": 1e-3}, "tension_noise": {"kN": 1e3}}
UNIT_RATIOS = (0.3, 10.0)
# Of the robot's size, and of the noise that is seen. Less than the last, in m, is no sensor's but that of digits.
MAX_NOISE_SHARE, MIN_NOISE_RATIO, MIN_SEEN_NOISE = 1e-3, 100.0, 1e-5
EFFECTS_ON_STIFFNESS = EFFECTS_ON_FORCES | {"modulus", "creep", "relaxation", "hysteresis", "stiffening"}


def robot_file_mistakes(robot: Robot, recording: Recording, file: str) -> Iterator[RobotFileError]:
    """Errors of ropes that stretch several times as much as declared, and of noise that is stated in another unit."""
    yield from _noise_errors(robot, recording, file)
    if robot.formulas or {setting.name for setting in robot.effects} & EFFECTS_ON_STIFFNESS:
        return
    cells = load_cell_scale(robot, recording)
    if cells is not None and abs(cells.carried - 1.0) > MAX_UNEXPLAINED:
        # Numbers that are no tensions tell nothing of ropes.
        return
    compliance = rope_compliance(robot, recording)
    if compliance is None or not is_other_rope(robot, compliance):
        return
    ratio, modulus = compliance.ratio, robot.cables[0].modulus
    problem = (
        f"is {modulus:.4g} Pa, and with the area {ratio:.3g} (+- {2.0 * compliance.deviation:.1g}) times what the "
        "recording says of all ropes: so much more they stretch under the measured tensions"
    )
    hint = (
        f"write it in Pa, {modulus / ratio:.3g} fits, or else the area of the section in m^2, "
        f"{robot.cables[0].area / ratio:.3g} fits; if neither is known state modulus_uncertainty"
    )
    yield RobotFileError(f"{file}: cable[1].modulus", problem, hint, ("cable", 0, "modulus"))


def _noise_errors(robot: Robot, recording: Recording, file: str) -> Iterator[RobotFileError]:
    """Errors of deviations that are a unit's factor off what the recording shows, or far too large for the robot."""
    size = max(float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors)
    shown = {"position_noise": ("m", recording.position), "tension_noise": ("N", recording.tension)}
    for key, (unit, values) in shown.items():
        declared = getattr(robot.sensors, key)
        floor = white_noise_deviation(values)
        if not declared or not 0.0 < floor < np.inf:
            continue
        meant = [
            f"if this is in {symbol} as {declared * factor:.4g}"
            for symbol, factor in NOISE_UNITS[key].items()
            if UNIT_RATIOS[0] < floor / (declared * factor) < UNIT_RATIOS[1]
        ]
        is_seen = key == "position_noise" and floor > MIN_SEEN_NOISE
        if (is_seen and declared > max(MAX_NOISE_SHARE * size, MIN_NOISE_RATIO * floor)) or (
            meant and key == "tension_noise"
        ):
            problem = f"is {declared:.4g} {unit}, and the noise of the recording is {floor:.2g} {unit}"
            hint = f"write the standard deviation of one sample in {unit}, {', '.join(meant) or f'as {floor:.1g}'}"
            yield RobotFileError(f"{file}: sensors.{key}", problem, hint, ("sensors", key))
