"""Recordings of exact sensors whose effect has another form than the list's: the right name alone, or what it is."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from tautwire.estimation import Trace, trace
from tautwire.recordings.recording import recording_from_frame
from tests.bench.trace.motion import MOTIONS, declared, program_of
from tests.rig import make_recording
from tests.support.robots import example

pytestmark = pytest.mark.validate

ROBOT, MOTION = declared("three"), MOTIONS["three"]
AIR_DENSITY = 1.225
TENSION = 0.45 * ROBOT.mass * ROBOT.gravity
MODULUS, DAMPING = float(ROBOT.modulus[0]), float(ROBOT.damping[0])
STRAIN = TENSION / (MODULUS * float(ROBOT.area[0]))

FORMS: dict[str, dict[str, Any]] = {
    "hysteresis with beta 0.6": {"hysteresis": {"force": 0.01 * TENSION, "yield_strain": 0.05 * STRAIN, "beta": 0.6}},
    "damping by a power": {"damping": {"damping": 3.0 * DAMPING, "exponent": 0.7, "reference": 0.1 * STRAIN}},
    "relaxation by a spectrum": {
        "relaxation": {"modulus": [0.03 * MODULUS] * 6, "time": np.geomspace(0.03, 10.0, 6).tolist()}
    },
    "creep by a power": {"creep": {"compliance": 0.05 / MODULUS, "time": 4.0, "form": "power"}},
    "thermal hyperbola": {"thermal": {"expansion": 1.2e-5, "rise": 20.0, "time": 8.0, "form": "hyperbolic"}},
    "drum in layers": {"drum": {"radius_ratio": 1.01, "build_up": 1e-4}},
    "linear friction": {"friction": {"coefficient": 0.03, "smoothing": 0.005, "form": "linear"}},
    "slack by a root": {"slack": {"softness": 0.5 * TENSION, "form": "root"}},
}


def traced(hidden: dict[str, Any]) -> Trace:
    fit, check = (
        recording_from_frame(
            make_recording(
                ROBOT, hidden, program_of("three", MOTION, seed), duration=MOTION.duration, rate=MOTION.rate, seed=seed
            ),
            ROBOT.count,
        )
        for seed in (11, 77)
    )
    return trace(example("three"), fit, check)


@pytest.mark.parametrize("hidden", FORMS.values(), ids=FORMS)
def test_an_effect_in_another_form_gets_its_name_and_no_other(hidden: dict[str, Any]) -> None:
    found = traced(hidden)
    assert found.verdict == "effects", found.sentence
    assert {effect.name for effect in found.effects} == set(hidden), found.sentence


def test_drag_that_is_linear_is_discovered_as_what_it_is() -> None:
    found = traced({"drag": {"drag_area": 10.0, "exponent": 1.0}})
    assert found.verdict == "discovered", found.sentence
    assert found.effects == ()
    assert found.formula is not None
    slopes = [float(number) for number in re.findall(r"force_[xyz] = (-[0-9.]+)\*v[xyz]", found.formula)]
    assert slopes == pytest.approx([-0.5 * AIR_DENSITY * 10.0] * 3, rel=0.03)
