"""The cable's law against formulas written out here, and in every kind of number."""

import math
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np
import pint
import pytest

from tautwire.robot.robot_assembly import NUMPY_MATHEMATICS
from tautwire.robot.symbolic_equations import CASADI_MATHEMATICS
from tautwire_fmu.laws.cable import (
    LAWS,
    CableConstants,
    CableInputs,
    CableMotion,
    CableOutputs,
    CableState,
    cable_motion,
    cable_outputs,
    fold_constant_effects,
    span,
    start_state,
    state_rates,
)
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, Mathematics, rate_of, with_rate

MODULUS, AREA, DAMPING, LENGTH, TENSION = 1.0e11, 1.2e-5, 5.0e8, 5.0, 900.0
DAMPED = (ActiveEffect(BY_NAME["damping"], BY_NAME["damping"].values(2e9)),)


def constants(law: str = "logarithmic", damping: float = DAMPING) -> CableConstants:
    return CableConstants(LAWS[law], (3.0, 0.0, 4.0), MODULUS, AREA, damping, LENGTH, TENSION, (0.6, 0.0, 0.8), 9.81)


def show(
    m: Mathematics, cable: CableConstants, state: CableState, inputs: CableInputs, effects: tuple[Any, ...] = ()
) -> CableOutputs:
    return cable_outputs(m, cable, effects, state, moved(m, cable, state, inputs, effects))


def moved(
    m: Mathematics, cable: CableConstants, state: CableState, inputs: CableInputs, effects: tuple[Any, ...] = ()
) -> CableMotion:
    return cable_motion(m, cable, effects, state, span(m, cable, inputs), inputs.winch_speed)


def at(position: tuple[Any, ...], velocity: tuple[Any, ...] = (0.0, 0.0, 0.0), speed: Any = 0.0) -> CableInputs:
    return CableInputs(position, velocity, speed)


def test_tension_at_the_start_is_what_statics_asks_for() -> None:
    cable = constants()
    shown = show(REAL, cable, start_state(cable, ()), at((0.0, 0.0, 0.0)))
    assert shown.tension == TENSION
    assert shown.elongation == 0.0
    assert shown.force == pytest.approx((0.6 * TENSION, 0.0, 0.8 * TENSION), rel=1e-15)


@pytest.mark.parametrize("law", ["logarithmic", "linear"])
def test_tension_follows_the_formula(law: str) -> None:
    state = CableState(4.999, 0.0015, ())
    velocity, speed = (0.1, -0.2, 0.3), 0.05
    shown = show(REAL, constants(law), state, at((0.01, 0.02, -0.03), velocity, speed))
    line = np.array([2.99, -0.02, 4.03])
    length = float(np.linalg.norm(line))
    rate = -float(line @ np.array(velocity)) / length
    strain = math.log(length / 4.999) if law == "logarithmic" else (length - 4.999) / length
    expected = MODULUS * AREA * strain + DAMPING * AREA * (rate + speed) / length + TENSION
    assert shown.tension == pytest.approx(expected, rel=1e-13)
    assert shown.elongation == pytest.approx(length - LENGTH + 0.0015, abs=1e-15)
    assert np.allclose(shown.force, expected * line / length, rtol=1e-13)


def test_the_winch_takes_up_strained_rope_under_the_logarithmic_law_only() -> None:
    state, inputs = CableState(4.99, 0.0, ()), at((0.0, 0.0, 0.0), speed=0.2)
    for law, expected in (("logarithmic", -0.2 * 4.99 / 5.0), ("linear", -0.2)):
        cable = constants(law)
        rates = state_rates(REAL, cable, (), state, moved(REAL, cable, state, inputs))
        assert rates.unstrained_length == pytest.approx(expected, rel=1e-15)
        assert rates.wound_length == 0.2


def test_a_cable_that_would_push_carries_nothing() -> None:
    shown = show(REAL, constants(), CableState(5.1, 0.0, ()), at((0.0, 0.0, 0.0)))
    assert shown.tension == 0.0
    assert shown.force == (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Cycle:
    """A closed path of the platform, traversed once."""

    phase: np.ndarray
    amplitude: float

    def work(self, damping: float) -> tuple[float, float]:
        """Work done by the cable on the platform round the path, and the energy that it stored at most."""
        angle = self.phase
        path = self.amplitude * np.array([np.sin(angle), np.zeros_like(angle), 1.0 - np.cos(angle)])
        pace = self.amplitude * np.array([np.cos(angle), np.zeros_like(angle), np.sin(angle)])
        cable = constants(damping=damping)
        shown = show(NUMPY_MATHEMATICS, cable, start_state(cable, ()), at(tuple(path), tuple(pace)))
        power = sum(force * speed for force, speed in zip(shown.force, pace, strict=True))
        stored = 0.5 * MODULUS * AREA * LENGTH * np.max(shown.strain) ** 2
        return float(np.mean(power[:-1]) * 2.0 * np.pi), float(stored)


CYCLE = Cycle(np.linspace(0.0, 2.0 * np.pi, 4097), 0.002)


def test_an_elastic_cable_makes_no_energy_round_a_closed_path() -> None:
    work, stored = CYCLE.work(damping=0.0)
    assert abs(work) < 1e-10 * stored


def test_a_damped_cable_only_takes_energy_round_a_closed_path() -> None:
    work, _ = CYCLE.work(damping=DAMPING)
    assert work < 0.0


def test_one_source_runs_on_floats_complex_steps_arrays_and_symbols() -> None:
    cable = constants()
    position, velocity, speed = (0.01, 0.02, -0.03), (0.1, -0.2, 0.3), 0.05
    state = CableState(4.999, 0.0, ((),))
    plain = show(REAL, cable, state, at(position, velocity, speed), DAMPED)
    columns = tuple(np.array([value, value]) for value in position)
    arrays = show(NUMPY_MATHEMATICS, cable, state, at(columns, velocity, speed), DAMPED)
    assert np.array_equal(arrays.tension, [plain.tension, plain.tension])
    symbol = casadi.SX.sym("x")
    symbolic = show(CASADI_MATHEMATICS, cable, state, at((symbol, *position[1:]), velocity, speed), DAMPED).tension
    slope = casadi.Function("slope", [symbol], [symbolic, casadi.gradient(symbolic, symbol)])
    value, exact = (float(number) for number in slope(position[0]))
    assert value == pytest.approx(plain.tension, rel=1e-14)
    stepped = show(
        COMPLEX_STEP, cable, state, at((with_rate(position[0], 1.0), *position[1:]), velocity, speed), DAMPED
    )
    assert rate_of(stepped.tension) == pytest.approx(exact, rel=1e-12)


def test_units_come_out_right() -> None:
    unit = pint.UnitRegistry()
    newton = unit.newton
    m = Mathematics(
        log=lambda x: math.log(x.to("").magnitude) * unit.dimensionless,
        exp=math.exp,
        sqrt=lambda x: x**0.5,
        sin=math.sin,
        cos=math.cos,
        tanh=math.tanh,
        atan2=math.atan2,
        absolute=abs,
        maximum=lambda a, b: a if a.to_base_units().magnitude > b else b,
        where=REAL.where,
    )
    metre, second, pascal = unit.metre, unit.second, unit.pascal
    cable = CableConstants(
        LAWS["logarithmic"],
        (3.0 * metre, 0.0 * metre, 4.0 * metre),
        MODULUS * pascal,
        AREA * metre**2,
        DAMPING * pascal * second,
        LENGTH * metre,
        TENSION * newton,
        (0.6, 0.0, 0.8),
        9.81 * unit.metre / unit.second**2,
    )
    effects = (ActiveEffect(BY_NAME["damping"], BY_NAME["damping"].values(2e9 * pascal * second)),)
    state = CableState(4.999 * metre, 0.0 * metre, ((),))
    velocity = tuple(speed * metre / second for speed in (0.01, -0.02, 0.03))
    inputs = at((0.0 * metre, 0.0 * metre, 0.0 * metre), velocity, 0.05 * metre / second)
    moving = moved(m, cable, state, inputs, effects)
    shown = cable_outputs(m, cable, effects, state, moving)
    rates = state_rates(m, cable, effects, state, moving)
    assert shown.tension.check("[force]")
    assert all(force.check("[force]") for force in shown.force)
    assert rates.unstrained_length.check("[velocity]")


MODULI = (*DAMPED, ActiveEffect(BY_NAME["modulus"], BY_NAME["modulus"].values(0.9e11)))


@pytest.mark.parametrize("law", LAWS)
def test_other_constants_do_what_the_effects_do_that_set_them(law: str) -> None:
    cable = constants(law)
    plain, none = fold_constant_effects(REAL, cable, MODULI)
    assert none == ()
    state, inputs = CableState(4.98, 0.1, ((), ())), at((0.1, 0.2, -0.1), (0.03, -0.2, 0.1), 0.4)
    found, expected = show(REAL, plain, state, inputs), show(REAL, cable, state, inputs, MODULI)
    assert found.force == pytest.approx(expected.force, rel=1e-14)
    assert found.tension == pytest.approx(expected.tension, rel=1e-14)


def test_a_cable_with_an_effect_that_does_more_is_left_as_it_is() -> None:
    creep = ActiveEffect(BY_NAME["creep"], BY_NAME["creep"].values(1e-12, 5.0, 0.0))
    for effects in ((), (creep,), (*DAMPED, creep)):
        assert fold_constant_effects(REAL, constants(), effects) == (constants(), effects)


def test_only_modulus_and_damping_set_constants() -> None:
    assert {name for name, effect in BY_NAME.items() if effect.only_sets_constants} == {"damping", "modulus"}
