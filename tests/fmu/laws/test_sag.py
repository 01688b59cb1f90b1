"""A rope with weight against the catenary solved for its own sake, and against springs in series."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from tautwire_fmu.laws.cable import LAWS, CableConstants, CableInputs, CableState, cable_motion, cable_outputs, span
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.mathematics import REAL

GRAVITY = 9.81
SAG = BY_NAME["sag"]


class Hanging(NamedTuple):
    """An inextensible rope between two points: forces on its lower and upper end, and its length."""

    lower: np.ndarray
    upper: np.ndarray
    arc: float


def catenary(across: float, up: float, weight: float, flat_pull: float) -> Hanging:
    """By the shape ``z = a cosh((x - x0) / a) + c`` with ``a = H / w``."""
    a = flat_pull / weight

    def height(x0: float) -> float:
        return a * (np.cosh((across - x0) / a) - np.cosh(x0 / a)) - up

    x0 = brentq(height, 0.5 * across - 15.0 * a, 0.5 * across + 15.0 * a, xtol=1e-13)
    slopes = np.sinh(np.array([-x0, across - x0]) / a)
    lower, upper = (np.array([flat_pull, flat_pull * slope]) for slope in slopes)
    return Hanging(lower, upper, float(a * (slopes[1] - slopes[0])))


def line(across: float, up: float) -> Route:
    chord = float(np.hypot(across, up))
    return Route((across / chord, 0.0, up / chord), chord, chord)


@pytest.mark.parametrize("across, up", [(30.0, 12.0), (8.0, 25.0), (40.0, 0.0), (20.0, -6.0)])
@pytest.mark.parametrize("slackness", [0.05, 0.3, 0.9])
def test_the_catenary_has_the_arc_and_the_ends_of_a_hanging_rope(across: float, up: float, slackness: float) -> None:
    route = line(across, up)
    weight = 2.0
    tension = weight * route.length / (2.0 * slackness)
    exact = catenary(across, up, weight, tension * across / route.length)
    values = SAG.values(weight / GRAVITY, 1.0)
    on_platform, at_cell = SAG.ends(REAL, values, GRAVITY, route, tension)
    force = np.array(on_platform) + tension * np.array(route.direction)
    assert force[[0, 2]] == pytest.approx(exact.lower, rel=1e-8, abs=1e-7 * tension)
    assert tension + at_cell == pytest.approx(float(np.linalg.norm(exact.upper)), rel=1e-8)
    at_start = cable(tension)._replace(start_length=route.length, start_direction=route.direction)
    now, before = SAG.sag(REAL, values, at_start, route, 0.0, (1e11, 0.0))
    assert now == pytest.approx(before, rel=1e-12)
    assert np.exp(now) * route.length == pytest.approx(exact.arc, rel=1e-8)


def cable(tension: float, modulus: float = 1e11) -> CableConstants:
    return CableConstants(
        LAWS["logarithmic"], (30.0, 0.0, 12.0), modulus, 1e-5, 0.0, LENGTH, tension, DIRECTION, GRAVITY
    )


LENGTH = float(np.hypot(30.0, 12.0))
DIRECTION = (30.0 / LENGTH, 0.0, 12.0 / LENGTH)


STILL = CableInputs((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)


def test_parabola_and_catenary_part_by_what_the_docstring_says() -> None:
    route, weight = line(30.0, 12.0), 2.0
    for x in (0.05, 0.1, 0.2):
        exact = catenary(30.0, 12.0, weight, weight * route.length / (2.0 * x) * 30.0 / route.length)
        flat = (30.0 / route.length) ** 2
        longer = flat * x**2 / 6.0
        parted = (exact.arc / route.length - 1.0 - longer) / longer
        assert abs(parted) < 2.0 / 15.0 * x**2
        assert abs(parted) > 0.2 / 15.0 * x**2


def tension_of(effects: tuple[ActiveEffect, ...], unstrained: float, held: float = 0.0) -> tuple[float, float]:
    """Tension of the span and arc of a rope at rest with some rope reeled in."""
    own = tuple((held,) + (0.0,) * (len(a.effect.states) - 1) if a.effect.states else () for a in effects)
    state = CableState(unstrained, 0.0, own)
    constants = cable(400.0)
    moving = cable_motion(REAL, constants, effects, state, span(REAL, constants, STILL, effects), 0.0)
    return cable_outputs(REAL, constants, effects, state, moving).span_tension, moving.arc


@pytest.mark.parametrize("shape", [0.0, 1.0])
@pytest.mark.parametrize("wound", [-0.2, -0.02, 0.0, 0.01, 0.05])
def test_tension_is_that_of_the_arc_which_it_makes(shape: float, wound: float) -> None:
    """Against a root sought without any guess of ours; with relaxation, which carries its share of the tension."""
    effects = tuple(
        ActiveEffect(BY_NAME[name], BY_NAME[name].values(**BY_NAME[name].completed_values(values)))
        for name, values in (
            ("sag", {"linear_density": 0.3, "catenary": shape}),
            ("relaxation", {"modulus": 3e10, "time": 1.0}),
        )
    )
    found, arc = tension_of(effects, LENGTH - wound)
    flat = DIRECTION[0] ** 2
    half = 0.15 * GRAVITY * LENGTH

    def longer(tension: float) -> float:
        x = half / tension
        return 0.5 * np.log1p(flat * (np.sinh(x) ** 2 / x**2 - 1.0)) if shape else np.log1p(flat * x**2 / 6.0)

    def missing(logarithm: float) -> float:
        tension = float(np.exp(logarithm))
        strain = np.log(LENGTH / (LENGTH - wound)) + longer(tension) - longer(400.0)
        return 1.3e6 * strain + 400.0 - tension

    exact = float(np.exp(brentq(missing, np.log(0.25 * half), 14.0, xtol=1e-14)))
    assert found == pytest.approx(exact, rel=1e-9)
    assert arc == pytest.approx(LENGTH * np.exp(longer(exact)), rel=1e-10)


def test_a_weightless_rope_may_hang_slack() -> None:
    light = ActiveEffect(SAG, SAG.values(0.0, 0.0))
    assert tension_of((light,), LENGTH + 0.1) == tension_of((), LENGTH + 0.1) == (0.0, LENGTH)
    heavy = ActiveEffect(SAG, SAG.values(0.1, 0.0))
    assert 0.0 < tension_of((heavy,), LENGTH + 0.1)[0] < 400.0


def test_a_short_rope_with_weight_is_a_spring_and_a_sag_in_series() -> None:
    """Ernst's modulus: 1/E_eq = 1/E + (w d)^2 S / (12 T^3)."""
    effect = ActiveEffect(SAG, SAG.values(0.3, 0.0))
    step = 1e-6
    tensions = [tension_of((effect,), LENGTH * np.exp(-strain))[0] for strain in (-step, step)]
    across = DIRECTION[0] * LENGTH
    series = 1.0 / 1e6 + (0.3 * GRAVITY * across) ** 2 / (12.0 * 400.0**3)
    assert (tensions[1] - tensions[0]) / (2.0 * step) == pytest.approx(1.0 / series, rel=2e-3)


def test_whole_weight_of_the_rope_hangs_on_both_ends() -> None:
    route = line(30.0, 12.0)
    on_platform, at_cell = SAG.ends(REAL, SAG.values(0.3, 0.0), GRAVITY, route, 400.0)
    top = np.sqrt((400.0 + at_cell) ** 2 - (400.0 * DIRECTION[0]) ** 2)
    assert top - (400.0 * DIRECTION[2] + on_platform[2]) == pytest.approx(0.3 * GRAVITY * LENGTH, rel=1e-12)
