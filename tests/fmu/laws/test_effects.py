"""What must hold of every effect that the project knows."""

from typing import Any

import numpy as np
import pytest

from tautwire_fmu.effect_variables import effects_from_resource
from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.cable import (
    LAWS,
    CableConstants,
    CableInputs,
    CableOutputs,
    CableState,
    cable_motion,
    cable_outputs,
    span,
    start_state,
    state_rates,
)
from tautwire_fmu.laws.effects import ALL, ActiveEffect, Effect, Parameter
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, Mathematics, rate_of, with_rate
from tautwire_fmu.laws.point_mass import PointMassConstants, acceleration, wrench
from tautwire_fmu.laws.rigid_body import principal_axes
from tautwire_fmu.laws.rigid_body_effects import BodyConstants, constants_with_effects, moment_of_effects
from tautwire_fmu.laws.vectors import add
from tautwire_fmu.units import UNITS
from tests.support.effect_cases import CASES, Case

CABLE = CableConstants(LAWS["logarithmic"], (3.0, 0.0, 4.0), 1e11, 1.2e-5, 5e8, 5.0, 900.0, (0.6, 0.0, 0.8), 9.81)
PLATFORM = PointMassConstants(80.0, 9.81)
INERTIA = ((4.0, 0.2, -0.1), (0.2, 5.0, 0.3), (-0.1, 0.3, 6.0))
BODY = BodyConstants(80.0, INERTIA, principal_axes(INERTIA), (0.1, -0.2, 0.3), ((0.5, 0.4, 0.0),))
STATE = (4.9735, 0.01)
INPUTS = CableInputs((0.01, -0.02, 0.03), (0.1, 0.2, -0.3), 0.15)
# What moves at an instant, as rates of position, velocity, winch speed and state.
MOVING = ((0.1, 0.2, -0.3), (0.7, -0.4, 0.2), 0.5)


def neutral(parameter: Parameter) -> float:
    return float(getattr(CABLE, parameter.name)) if parameter.neutral is None else parameter.neutral


def begun(effect: Effect) -> ActiveEffect:
    numbers = [neutral(p) * p.start_ratio if p.neutral is None else p.start for p in effect.parameters]
    return ActiveEffect(effect, effect.values(*numbers))


def of(case: Case) -> ActiveEffect:
    effect = next(e for e in ALL if e.name == case.name)
    return ActiveEffect(effect, effect.values(**effect.completed_values(case.law)))


def state_of(effects: tuple[ActiveEffect, ...], inner: float = 0.0) -> CableState:
    return CableState(*STATE, tuple((inner,) * len(a.effect.states) for a in effects))


def shown(effects: tuple[ActiveEffect, ...], inner: float = 0.0) -> tuple[Any, ...]:
    """All that a robot shows of its effects at one instant."""
    state = state_of(effects, inner)
    moving = cable_motion(REAL, CABLE, effects, state, span(REAL, CABLE, INPUTS, effects), INPUTS.winch_speed)
    none = tuple(() for _ in effects)
    force = add((5.0, 6.0, 7.0), wrench(REAL, effects, none, INPUTS.position, INPUTS.velocity))
    return (
        cable_outputs(REAL, CABLE, effects, state, moving),
        state_rates(REAL, CABLE, effects, state, moving)[:2],
        acceleration(REAL, PLATFORM, effects, none, force),
        constants_with_effects(REAL, BODY, effects, [effects]),
        moment_of_effects(REAL, effects, (0.3, -0.2, 0.5)),
        stages.sensor_gains(REAL, effects),
        stages.sensor_offsets(REAL, effects),
        stages.sensor_delays(REAL, effects),
    )


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_neutral_values_mean_exactly_absent(effect: Effect) -> None:
    absent = ActiveEffect(effect, effect.values(*map(neutral, effect.parameters)))
    assert shown((absent,)) == shown(())


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_where_fits_begin_the_effect_is_present(effect: Effect) -> None:
    assert shown((begun(effect),), 0.1) != shown(())


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_its_description_is_complete(effect: Effect) -> None:
    assert effect.description
    assert effect.source
    assert effect.component in {"cable", "winch", "platform", "sensor"}
    assert effect.values._fields == tuple(p.name for p in effect.parameters)
    for parameter in effect.parameters:
        assert parameter.description
        assert parameter.unit in UNITS
        assert parameter.minimum <= parameter.start <= parameter.maximum
        assert parameter.neutral is None or parameter.minimum <= parameter.neutral <= parameter.maximum
    assert all(state.unit in UNITS and state.scale > 0.0 for state in effect.states)
    assert bool(effect.states) == (effect.state_rates is not None or effect.low_pass is not None)


def test_filters_of_load_cells_have_their_state_in_cables_and_none_on_the_platform() -> None:
    switched_on = {"effects": [{"name": "sensor_delay"}]}
    (in_cable,) = effects_from_resource({"law": "linear", **switched_on})
    (on_platform,) = effects_from_resource(switched_on)
    assert len(in_cable.states) == 1
    assert on_platform.states == ()
    assert on_platform.low_pass is None
    assert on_platform.delay is in_cable.delay


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_each_form_frees_parameters_that_bring_the_effect_about(effect: Effect) -> None:
    assert effect.forms
    for form in effect.forms:
        freed = {p.name: p.start for p in effect.parameters if p.name in form}
        assert set(freed) == set(form)
        given = {p.name: neutral(p) * p.start_ratio for p in effect.parameters if p.neutral is None}
        values = effect.values(**effect.completed_values({**freed, **given}))
        assert shown((ActiveEffect(effect, values),), 0.1) != shown(())


def test_names_are_unique() -> None:
    assert len({effect.name for effect in ALL}) == len(ALL)


@pytest.mark.parametrize("stage", ["path", "sag"])
def test_stages_of_one_effect_alone_are(stage: str) -> None:
    assert sum(getattr(effect, stage) is not None for effect in ALL) == 1


def test_the_order_of_effects_does_not_matter() -> None:
    present = tuple(map(begun, ALL))
    forward, backward = shown(present, 0.01), shown(present[::-1], 0.01)
    assert forward[0].tension == pytest.approx(backward[0].tension, rel=1e-12)
    assert forward[0].force == pytest.approx(backward[0].force, rel=1e-12)
    assert forward[1] == pytest.approx(backward[1], rel=1e-12)
    assert forward[2] == pytest.approx(backward[2], rel=1e-12)
    for one, other in zip(forward[3], backward[3], strict=True):
        assert np.array(one) == pytest.approx(np.array(other), rel=1e-12)
    assert forward[4:] == backward[4:]


def test_creep_follows_the_tension_that_the_rope_carries_whatever_makes_it() -> None:
    given = {
        "creep": {"compliance": 2e-12, "time": 4.0},
        "thermal": {"rise": 10.0},
        "relaxation": {"modulus": 3e10},
        "sag": {"linear_density": 0.3},
        "modulus": {"modulus": 0.9e11},
    }
    effects = tuple(of(Case(name, {}, values)) for name, values in given.items())
    cable = CABLE._replace(damping=0.0)
    state = state_of(effects, 1e-4)
    moving = cable_motion(REAL, cable, effects, state, span(REAL, cable, INPUTS, effects), INPUTS.winch_speed)
    carried = cable_outputs(REAL, cable, effects, state, moving).span_tension
    creeping = state_rates(REAL, cable, effects, state, moving).effects[0][0]
    assert carried > 100.0
    assert creeping == pytest.approx(2e-12 / (4.0 + 1e-4) * carried / cable.area, rel=1e-12)


def read(m: Mathematics, effects: tuple[ActiveEffect, ...], state: CableState, inputs: CableInputs) -> CableOutputs:
    moving = cable_motion(m, CABLE, effects, state, span(m, CABLE, inputs, effects), inputs.winch_speed)
    return cable_outputs(m, CABLE, effects, state, moving)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_rates_by_a_complex_step_are_the_slopes(case: Case) -> None:
    effects = (of(case),)
    state = state_of(effects, 2e-4)
    moving = cable_motion(REAL, CABLE, effects, state, span(REAL, CABLE, INPUTS, effects), INPUTS.winch_speed)
    rates = state_rates(REAL, CABLE, effects, state, moving)

    def at(time: float) -> CableOutputs:
        later = CableState(
            state.unstrained_length + time * rates.unstrained_length,
            state.wound_length + time * rates.wound_length,
            tuple(
                tuple(s + time * r for s, r in zip(own, slopes, strict=True))
                for own, slopes in zip(state.effects, rates.effects, strict=True)
            ),
        )
        values = (INPUTS.position, INPUTS.velocity)
        position, velocity = (
            tuple(x + time * r for x, r in zip(value, slopes, strict=True))
            for value, slopes in zip(values, MOVING[:2], strict=True)
        )
        return read(REAL, effects, later, CableInputs(position, velocity, INPUTS.winch_speed + time * MOVING[2]))

    carried = CableInputs(
        tuple(map(with_rate, INPUTS.position, MOVING[0])),
        tuple(map(with_rate, INPUTS.velocity, MOVING[1])),
        with_rate(INPUTS.winch_speed, MOVING[2]),
    )
    inner = tuple(tuple(map(with_rate, own, slopes)) for own, slopes in zip(state.effects, rates.effects, strict=True))
    stepped = CableState(
        with_rate(state.unstrained_length, rates.unstrained_length),
        with_rate(state.wound_length, rates.wound_length),
        inner,
    )
    exact = read(COMPLEX_STEP, effects, stepped, carried)
    before, after = at(-1e-6), at(1e-6)
    for name in ("tension", "pull", "length", "strain"):
        slope = (getattr(after, name) - getattr(before, name)) / 2e-6
        assert rate_of(getattr(exact, name)) == pytest.approx(slope, rel=1e-6, abs=1e-7), name
    forces = (np.array(after.force) - np.array(before.force)) / 2e-6
    assert [rate_of(force) for force in exact.force] == pytest.approx(forces, rel=1e-6, abs=1e-3)


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
@pytest.mark.parametrize("present", [False, True])
def test_rates_are_finite_at_rest_at_the_start(effect: Effect, present: bool) -> None:
    values = begun(effect).values if present else effect.values(*map(neutral, effect.parameters))
    effects = (ActiveEffect(effect, values),)
    state = start_state(CABLE, effects)
    still = CableInputs((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    for axis in range(3):
        push = tuple(with_rate(0.0, float(axis == k)) for k in range(3))
        for inputs in (still._replace(position=push), still._replace(velocity=push)):
            assert np.isfinite([rate_of(force) for force in read(COMPLEX_STEP, effects, state, inputs).force]).all()
    force = wrench(COMPLEX_STEP, effects, ((),), push, push)
    pushed = acceleration(COMPLEX_STEP, PLATFORM, effects, ((),), force)
    assert np.isfinite([rate_of(a) for a in pushed]).all()
