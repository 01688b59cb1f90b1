"""What a trace makes of a search: the co-simulation of the rebuilt FMUs has the last word."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, run_cosimulation
from tautwire.estimation import Trace, trace
from tautwire.estimation.cosimulation_validation import output_errors
from tautwire.estimation.disturbance import NEUTRAL
from tautwire.estimation.identification import _disturbance_notes
from tautwire.estimation.parameter_stability import RECORDINGS
from tautwire.estimation.trace_result import Estimate, FoundEffect
from tests.support.recordings import recorded
from tests.support.robots import example

pytestmark = pytest.mark.validate

HIDDEN = {"damping": {"damping": 9e8}}


def traced() -> Trace:
    fit, check = (recorded("three", seed, HIDDEN).first(401) for seed in (3, 53))
    return trace(example("three"), fit, check, lambda what, done: None)


def test_the_rebuilt_fmus_give_the_error_after() -> None:
    found = traced()
    assert found.verdict == "effects"
    for comparison in found.comparisons:
        again = output_errors(comparison.recording, comparison.after)
        assert again.tension_rms == comparison.errors_after.tension_rms
        assert again.tension_rms < 1.2 * found.noise_floor.tension_rms < comparison.errors_before.tension_rms
    assert found.robot_after.effects[0].name == "damping"
    assert found.robot_before == example("three")


def beside_disturbance(verdict: str, effects: Sequence[FoundEffect], small: Sequence[FoundEffect] = ()) -> Any:
    """As much of a state as its notes on a disturbance are made of."""
    fitter = SimpleNamespace(noise=SimpleNamespace(disturbance=NEUTRAL))
    split = SimpleNamespace(estimation=SimpleNamespace(recording=recorded("three", 1)))
    context = SimpleNamespace(fitter=fitter, split=split)
    return SimpleNamespace(context=context, verdict=(verdict, ""), effects=effects, small_effects=small)


@pytest.mark.parametrize(("verdict", "is_told"), [("effects", True), ("none", True), ("unexplained", False)])
def test_what_would_explain_all_but_has_no_name_is_not_called_small(verdict: str, is_told: bool) -> None:
    relaxation = FoundEffect("relaxation", "cable", (1, 2, 3), {}, 50.0, share=0.87)
    state = beside_disturbance(verdict, (), (relaxation,))
    assert any("too small to matter: relaxation" in note for note in _disturbance_notes(state)) == is_told


def test_intervals_that_are_wide_for_the_same_reason_share_a_note() -> None:
    ends = ("kg", 1.0, 3.0, None)
    effects = [
        FoundEffect("payload", "platform", (), {"mass": Estimate(2.0, *ends, RECORDINGS)}, 50.0),
        FoundEffect("drag", "platform", (), {"drag_area": Estimate(2.0, *ends, RECORDINGS)}, 50.0),
        FoundEffect("creep", "cable", (), {"fluidity": Estimate(2.0, *ends)}, 50.0),
    ]
    assert _disturbance_notes(beside_disturbance("effects", effects))[1:] == [
        "the width of the 95 % interval of mass of payload and of drag_area of drag is mostly due to two recordings "
        "that give different values"
    ]


def test_no_name_is_given_where_the_rebuilt_fmus_miss_the_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = []

    def astray(*arguments: Any, **options: Any) -> CosimulationResult:
        motion = run_cosimulation(*arguments, **options)
        runs.append(motion)
        return replace(motion, position=motion.position + 0.01) if len(runs) > 2 else motion

    monkeypatch.setattr("tautwire.estimation.cosimulation_validation.run_cosimulation", astray)
    found = traced()
    assert len(runs) == 4
    assert found.verdict == "unexplained"
    assert found.sentence.endswith("damping comes closest, but not close enough.")
    assert found.effects == ()
    assert found.robot_after == found.robot_before
    assert all(np.array_equal(c.after.position, c.before.position) for c in found.comparisons)
