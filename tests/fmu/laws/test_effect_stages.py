"""The rope's route over a pulley, found by minimising its length; and effects that share a stage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.mathematics import REAL

ANCHOR = (1.0, -2.0, 6.0)


def active(name: str, **values: float) -> ActiveEffect:
    effect = BY_NAME[name]
    return ActiveEffect(effect, effect.values(**effect.completed_values(values)))


def stretched(position: np.ndarray, radius: float) -> tuple[np.ndarray, float]:
    """Where a taut string leaves the pulley, and its length: of all points of the rim the one of the shortest way.

    The string comes up at the anchor and goes over the top; from a point at angle ``a`` it would run straight.
    Tangents make the way stationary, and only the outer one does not cut the pulley.
    """
    across = position[:2] - np.array(ANCHOR[:2])
    outward = np.append(across / np.linalg.norm(across), 0.0)
    centre = np.array(ANCHOR) + radius * outward

    def point(angle: float) -> np.ndarray:
        return centre + radius * (np.cos(angle) * outward + np.sin(angle) * np.array([0.0, 0.0, 1.0]))

    def misfit(angle: float) -> float:
        away = position - point(angle)
        return float(abs(away @ (point(angle) - centre)) / np.linalg.norm(away))

    angles = np.linspace(-0.5 * np.pi, np.pi, 4001)
    tangents = [a for a in angles if leaves_outward(position, point(a), centre)]
    best = tangents[int(np.argmin([misfit(a) for a in tangents]))]
    result = minimize_scalar(misfit, bounds=(best - 1e-2, best + 1e-2), method="bounded", options={"xatol": 1e-13}).x
    return point(result), float(np.linalg.norm(position - point(result)) + radius * (np.pi - result))


def leaves_outward(position: np.ndarray, point: np.ndarray, centre: np.ndarray) -> bool:
    """Whether the string would go on in the sense in which it came over the top."""
    forward = np.cross(point - centre, position - point)
    turning = np.cross(np.array([0.0, 0.0, 1.0]), position - np.array(ANCHOR))
    return float(forward @ turning) > 0.0


PLACES = [(3.0, 1.0, 0.5), (9.0, -2.5, 5.0), (1.4, -2.1, 0.0), (6.0, 4.0, 6.5)]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("radius", [0.05, 0.3])
def test_a_rope_leaves_the_pulley_on_a_tangent(place: tuple[float, float, float], radius: float) -> None:
    position = np.array(place)
    point, length = stretched(position, radius)
    route = stages.route(REAL, (active("pulley", radius=radius),), ANCHOR, place)
    assert route.length == pytest.approx(length, abs=1e-6)
    assert route.direction == pytest.approx((point - position) / np.linalg.norm(point - position), abs=1e-6)
    assert route.chord == pytest.approx(np.linalg.norm(position - np.array(ANCHOR)))


@pytest.mark.parametrize("place", PLACES)
def test_its_length_changes_along_the_rope(place: tuple[float, float, float]) -> None:
    effects = (active("pulley", radius=0.3), active("anchor", x=0.2, z=-0.1))
    slopes = []
    for axis in range(3):
        step = 1e-5 * np.eye(3)[axis]
        ends = [stages.route(REAL, effects, ANCHOR, tuple(np.array(place) + s)).length for s in (-step, step)]
        slopes.append((ends[1] - ends[0]) / 2e-5)
    route = stages.route(REAL, effects, ANCHOR, place)
    assert slopes == pytest.approx([-d for d in route.direction], abs=1e-9)
    assert np.linalg.norm(route.direction) == pytest.approx(1.0, rel=1e-14)


def test_a_pulley_goes_along_with_its_anchor() -> None:
    pulley = active("pulley", radius=0.2)
    moved = stages.route(REAL, (active("anchor", x=0.5, y=-0.2, z=0.1), pulley), ANCHOR, PLACES[0])
    there = stages.route(REAL, (pulley,), (1.5, -2.2, 6.1), PLACES[0])
    assert moved.length == pytest.approx(there.length, rel=1e-15)
    assert moved.direction == pytest.approx(there.direction, rel=1e-14)


def test_straight_under_the_exit_point_the_pulley_hangs_no_way_at_all() -> None:
    below = (1.0, -2.0, 1.0)
    none = stages.route(REAL, (active("pulley", radius=0.0),), ANCHOR, below)
    assert none == stages.route(REAL, (), ANCHOR, below)


def test_gains_multiply_and_offsets_and_delays_add() -> None:
    twice = (active("sensor_gain", tension_gain=1.5), active("sensor_gain", tension_gain=2.0, position_gain=0.5))
    assert stages.sensor_gains(REAL, twice) == (3.0, 0.5)
    low = (
        active("sensor_offset", tension_offset=-3.0, position_offset_y=0.5),
        active("sensor_offset", tension_offset=1.0),
    )
    assert stages.sensor_offsets(REAL, low) == (-2.0, (0.0, 0.5, 0.0))
    late = (active("sensor_delay", tension_delay=0.1), active("sensor_delay", tension_delay=0.2, position_delay=0.4))
    assert stages.sensor_delays(REAL, late) == pytest.approx((0.3, 0.4))


def test_low_pass_filters_in_series_each_follow_what_the_one_before_shows() -> None:
    """With E A = 2000 N, 0.1 of it above 700 N shows 900 N; rates are those of dy/dt = (T - y) / tau over E A."""
    in_series = (active("sensor_delay", tension_time_constant=0.5), active("sensor_delay", tension_time_constant=0.2))
    shown, rates = stages.low_pass(REAL, in_series, ((0.1,), (-0.2,)), 1000.0, (700.0, 2000.0))
    assert shown == pytest.approx(300.0)
    assert rates == (pytest.approx((0.1,)), pytest.approx((1.5,)))
    assert stages.has_low_pass(in_series)
    assert stages.moves_states(REAL, in_series) > 0.0


def test_a_load_cell_without_a_time_constant_shows_the_tension_at_once_and_moves_no_state() -> None:
    late = (active("sensor_delay", tension_delay=0.1),)
    assert stages.low_pass(REAL, late, ((0.0,),), 1000.0, (700.0, 2000.0)) == (1000.0, ((0.0,),))
    assert stages.moves_states(REAL, late) == 0.0
    assert stages.moves_states(REAL, (active("slack", softness=100.0),)) == 0.0
    assert stages.moves_states(REAL, (*late, active("creep", compliance=1e-12))) > 0.0


def test_a_soft_rope_keeps_its_start_tension_and_never_pushes() -> None:
    cable = type("Cable", (), {"start_tension": 250.0})
    soft = (active("slack", softness=100.0),)
    assert stages.carried_tension(REAL, soft, cable, 250.0) == pytest.approx(250.0, rel=1e-14)
    pulls = np.linspace(-3000.0, 3000.0, 101)
    tensions = np.array([stages.carried_tension(REAL, soft, cable, float(pull)) for pull in pulls])
    assert np.all(tensions > 0.0)
    assert np.all(np.diff(tensions) > 0.0)
    expected = 100.0 * np.logaddexp(0.0, (pulls + 100.0 * np.log1p(-np.exp(-2.5))) / 100.0)
    assert tensions == pytest.approx(expected, rel=1e-12)
