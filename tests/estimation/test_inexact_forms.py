"""A recording of exact sensors whose effect has another form than the list's: the right name alone.

``make bench-trace`` has more forms.
"""

from __future__ import annotations

import pytest

from tautwire.estimation import trace
from tautwire.recordings.recording import recording_from_frame
from tests.bench.trace.motion import MOTIONS, declared, program_of
from tests.rig import make_recording
from tests.support.robots import example

ROBOT, MOTION = declared("three"), MOTIONS["three"]
TENSION = 0.45 * ROBOT.mass * ROBOT.gravity
STRAIN = TENSION / float(ROBOT.modulus[0] * ROBOT.area[0])


@pytest.mark.validate
def test_a_hysteresis_of_another_shape_gets_its_name_and_no_other() -> None:
    hidden = {"hysteresis": {"force": 0.01 * TENSION, "yield_strain": 0.05 * STRAIN, "beta": 0.6}}
    fit, check = (
        recording_from_frame(
            make_recording(
                ROBOT, hidden, program_of("three", MOTION, seed), duration=MOTION.duration, rate=MOTION.rate, seed=seed
            ),
            ROBOT.count,
        )
        for seed in (11, 77)
    )
    found = trace(example("three"), fit, check)
    assert found.verdict == "effects", found.sentence
    assert {effect.name for effect in found.effects} == set(hidden), found.sentence
