"""What must hold of every effect that the project knows."""

from typing import Any

import pytest

from tautwire_fmu.laws.cable import LAWS, CableConstants, CableInputs, CableState, motion, reading, span
from tautwire_fmu.laws.effects import ALL, ActiveEffect, Effect, Parameter
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, acceleration
from tautwire_fmu.units import UNITS

CABLE = CableConstants(LAWS["logarithmic"], (3.0, 0.0, 4.0), 1e11, 1.2e-5, 5e8, 5.0, 900.0)
PLATFORM = PointMassConstants(80.0, 9.81)
STATE = (4.965, 0.01)
INPUTS = CableInputs((0.01, -0.02, 0.03), (0.1, 0.2, -0.3), 0.15)


def neutral(parameter: Parameter) -> float:
    return float(getattr(CABLE, parameter.name)) if parameter.neutral is None else parameter.neutral


def shown(effects: tuple[ActiveEffect, ...]) -> tuple[Any, ...]:
    state = CableState(*STATE, tuple((0.0,) * len(a.effect.states) for a in effects))
    moving = motion(REAL, CABLE, effects, state, span(REAL, CABLE, INPUTS), INPUTS.winch_speed)
    return (
        reading(REAL, CABLE, effects, state, moving),
        moving.rope_speed,
        acceleration(REAL, PLATFORM, effects, state.effects, INPUTS.position, INPUTS.velocity, (5.0, 6.0, 7.0)),
    )


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_neutral_values_mean_exactly_absent(effect: Effect) -> None:
    absent = ActiveEffect(effect, effect.values(*map(neutral, effect.parameters)))
    assert shown((absent,)) == shown(())


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_where_fits_begin_the_effect_is_present(effect: Effect) -> None:
    begun = [neutral(p) * p.start_ratio if p.neutral is None else p.start for p in effect.parameters]
    assert shown((ActiveEffect(effect, effect.values(*begun)),)) != shown(())


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_its_description_is_complete(effect: Effect) -> None:
    assert effect.description
    assert effect.source
    assert effect.component in {"cable", "winch", "platform", "sensor"}
    assert effect.values._fields == tuple(p.name for p in effect.parameters)
    for parameter in effect.parameters:
        assert parameter.unit in UNITS
        assert parameter.minimum <= parameter.start <= parameter.maximum
        assert parameter.neutral is None or parameter.minimum <= parameter.neutral <= parameter.maximum
    assert all(state.unit in UNITS for state in effect.states)


def test_names_are_unique() -> None:
    assert len({effect.name for effect in ALL}) == len(ALL)


def test_the_order_of_effects_does_not_matter() -> None:
    present = tuple(
        ActiveEffect(e, e.values(*[neutral(p) * 1.1 if p.neutral is None else p.start for p in e.parameters]))
        for e in ALL
    )
    forward, backward = shown(present), shown(present[::-1])
    assert forward[0].tension == pytest.approx(backward[0].tension, rel=1e-13)
    assert forward[1] == pytest.approx(backward[1], rel=1e-13)
    assert forward[2] == pytest.approx(backward[2], rel=1e-13)
