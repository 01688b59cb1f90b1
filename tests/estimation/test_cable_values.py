"""Values of single cables: drums whose radii differ, and drums whose radii do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation import cable_values
from tautwire.estimation.cable_values import with_values_of_cables
from tautwire.estimation.disturbance_fit import joint_fit, with_fitted_disturbance
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import DataSet, DataSplit
from tautwire.estimation.hypotheses import Hypothesis, hypotheses, labels_by_effect
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.selection_result import SelectionResult
from tautwire.recordings.winch_scales import WinchScale
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
NOISE = estimate_noise(ROBOT, recorded("three", 1))
DRUM = next(h for h in hypotheses(ROBOT) if h.effect.name == "drum" and h.cables == ROBOT.cable_numbers)


def selected(
    ratios: tuple[float, float, float], evidence: float = 100.0, has_tension: bool = True
) -> tuple[IdentificationContext, SelectionResult]:
    """A drum that all cables share, fitted to recordings whose ropes move by these ratios of what encoders say."""
    data_sets = []
    for seed in (1, 2):
        recording = recorded("three", seed).first(400)
        recording = replace(recording, winch_speed=recording.winch_speed / np.array(ratios))
        if not has_tension:
            recording = replace(recording, tension=np.full_like(recording.tension, np.nan))
        data_sets.append(DataSet(recording, ROBOT.platform.start, np.ones(len(recording.time), dtype=bool)))
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    fit = fitter.fit_from([ROBOT.with_effect(DRUM.setting(ROBOT))], (DRUM,), data_sets[0])
    fitter, fit = joint_fit(
        with_fitted_disturbance(fitter, fit.robot, (DRUM,), data_sets[0]), fit, (DRUM,), data_sets[0]
    )
    context = IdentificationContext(ROBOT, fitter, DataSplit(data_sets[0], data_sets[1], ()))
    return context, SelectionResult((DRUM,), (evidence,), fit, (), ())


@pytest.mark.validate
def test_cables_that_differ_get_values_of_their_own() -> None:
    ratios = (0.95, 0.97, 0.96)
    context, shared = selected(ratios)
    _, separate = with_values_of_cables(context, shared)
    assert [hypothesis.cables for hypothesis in separate.accepted] == [(1,), (2,), (3,)]
    assert separate.evidence == (100.0,) * 3
    assert separate.fit.values == pytest.approx(ratios, abs=2e-3)
    assert {each.cables: each.values["radius_ratio"] for each in separate.fit.robot.effects} == {
        (cable,): value for cable, value in zip((1, 2, 3), separate.fit.values, strict=True)
    }
    assert labels_by_effect(separate.accepted, ROBOT) == ["drum"] * 3


def test_cables_that_do_not_differ_share_a_value() -> None:
    context, shared = selected((0.96, 0.96, 0.96))
    assert shared.fit.values == pytest.approx([0.96], abs=2e-3)
    assert with_values_of_cables(context, shared) == (context, shared)


@pytest.mark.validate
def test_differences_that_the_effects_form_may_leave_are_none_of_the_cables() -> None:
    context, shared = selected((0.95, 0.97, 0.96), evidence=1e7)
    assert with_values_of_cables(context, shared) == (context, shared)


@pytest.mark.parametrize(("has_tension", "evidence"), [(False, 1e7), (False, 1e-3), (True, 1e7)])
def test_without_tensions_drums_have_the_radii_that_kinematics_tell_unless_check_contradicts(
    monkeypatch: pytest.MonkeyPatch, has_tension: bool, evidence: float
) -> None:
    scales = tuple(WinchScale(cable, factor, 1e-3) for cable, factor in ((1, 0.952), (2, 0.968), (3, 0.961)))
    monkeypatch.setattr(cable_values, "kinematic_scales", lambda robot, recording: scales)
    context, shared = selected((0.96, 0.96, 0.96), evidence, has_tension)
    context_after, after = with_values_of_cables(context, shared)
    if has_tension or evidence < 1.0:
        assert (context_after, after) == (context, shared)
        return
    assert [(h.effect.name, h.cables) for h in after.accepted] == [("drum", (cable,)) for cable in (1, 2, 3)]
    assert after.fit.values.tolist() == [scale.factor for scale in scales]
    assert after.fit.standard_deviations == pytest.approx([1e-3] * 3)
    assert after.evidence == (evidence,) * 3
    assert after.disturbance == context_after.fitter.noise.disturbance != context.fitter.noise.disturbance


@pytest.mark.validate
def test_kinematics_tell_the_radius_of_each_drum_beside_another_effect() -> None:
    ratios = (0.95, 0.97, 0.96)
    context, shared = selected(ratios, has_tension=False)
    payload = next(h for h in hypotheses(ROBOT) if h.effect.name == "payload")
    robot = shared.fit.robot.with_effect(payload.setting(ROBOT))
    both = (payload, DRUM)
    fit = context.fitter.fit_from([robot], both, context.split.estimation)
    _, after = with_values_of_cables(context, replace(shared, accepted=both, evidence=(50.0, 100.0), fit=fit))
    assert [h.effect.name for h in after.accepted] == ["payload", "drum", "drum", "drum"]
    assert after.evidence == (50.0, 100.0, 100.0, 100.0)
    found = {each.cables: each.values for each in after.fit.robot.effects}
    assert [found[cable,]["radius_ratio"] for cable in (1, 2, 3)] == pytest.approx(ratios, abs=4e-3)
    assert abs(found[()]["mass"]) < 0.05 * ROBOT.platform.mass


def test_an_effect_on_some_cables_is_labelled_with_them() -> None:
    first, third = (Hypothesis(DRUM.effect, (cable,), DRUM.form) for cable in (3, 1))
    assert labels_by_effect([first, third], ROBOT) == ["drum of cable 1, 3"] * 2
