"""The law of a sampled controller: python-control's own response, limits, interpolation, the end of the path."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire_fmu.laws.sampled_control import (
    ControllerState,
    ControlPlan,
    Gains,
    Limits,
    acceleration,
    gains_at,
    initial_controller_state,
    next_controller_state,
)

Array = NDArray[np.float64]

PERIOD = 0.01
FREE = Limits(1e15, 1e15, -1e15, 1e15)
CABLES, STATES = 3, 5


def some_plan(samples: int = 60, knots: int = 1) -> ControlPlan:
    """A stable regulator at each knot on a wandering path."""
    random = np.random.default_rng(7)
    gains = []
    for _ in range(knots):
        A = random.standard_normal((STATES, STATES))
        parts = {
            "A": 0.8 * A / np.max(np.abs(np.linalg.eigvals(A))),
            "B": random.standard_normal((STATES, 3 + 2 * CABLES)),
            "C": random.standard_normal((CABLES, STATES)),
            "D": -random.uniform(1.0, 5.0) * np.eye(CABLES),
            "M": 0.1 * random.standard_normal((STATES, CABLES)),
        }
        gains.append(Gains(**{name: part.tolist() for name, part in parts.items()}))
    return ControlPlan(
        period=PERIOD,
        speeds=np.cumsum(random.uniform(-0.01, 0.01, (samples, CABLES)), axis=0).tolist(),
        stretches=np.zeros((samples, CABLES)).tolist(),
        expected=random.standard_normal((samples, 3 + CABLES)).tolist(),
        at_rest=[1.0] * CABLES,
        knots=np.linspace(0.0, samples / 2, knots).tolist(),
        gains=gains,
        compliances=[1e-5] * CABLES,
        yield_time=0.06,
        tares=False,
    )


def walked(plan: ControlPlan, limits: Limits, seen: Array) -> list[ControllerState]:
    """The memory at each sample, under deviations seen from what is expected."""
    memory = initial_controller_state(plan, limits)
    results = [memory]
    for k, away in enumerate(seen):
        expected = plan.expected[min(k, len(plan.expected) - 1)]
        memory = next_controller_state(
            plan, limits, memory, [e + float(a) for e, a in zip(expected, away, strict=True)]
        )
        results.append(memory)
    return results


def noise(samples: int, size: float) -> Array:
    return size * np.random.default_rng(3).standard_normal((samples, 3 + CABLES))


def test_without_limits_it_is_python_controls_own_response() -> None:
    plan, seen = some_plan(), noise(59, 1e-2)
    memories = walked(plan, FREE, seen)
    gains = plan.gains[0]
    system: Any = control.ss(gains.A, gains.B, gains.C, np.hstack([np.zeros((CABLES, 3 + CABLES)), gains.D]), PERIOD)
    away = np.array([m.begin for m in memories]) - np.array(plan.speeds)
    expected = control.forced_response(system, np.arange(59) * PERIOD, np.hstack([seen, away[:59]]).T).outputs.T
    asked = np.diff(away, axis=0) / PERIOD
    assert asked == pytest.approx(expected, abs=1e-9)


def test_speeds_run_on_from_sample_to_sample() -> None:
    memories = walked(some_plan(), FREE, noise(30, 1e-2))
    for before, after in pairwise(memories):
        assert after.begin == before.end and after.sample == before.sample + 1
    rates = acceleration(some_plan(), memories[4])
    assert rates == pytest.approx((np.array(memories[4].end) - memories[4].begin) / PERIOD)


def test_a_sample_acts_only_after_the_next_one() -> None:
    plan, seen = some_plan(), noise(10, 1e-2)
    other = seen.copy()
    other[4] += 0.1
    ones, others = walked(plan, FREE, seen), walked(plan, FREE, other)
    assert ones[4].end == others[4].end
    assert ones[5].begin == others[5].begin
    assert ones[5].end != others[5].end


def test_limits_of_speed_and_acceleration_are_kept() -> None:
    memories = walked(some_plan(), Limits(0.03, 0.8, -1e15, 1e15), noise(59, 0.3))
    begin, end = np.array([m.begin for m in memories]), np.array([m.end for m in memories])
    assert np.max(np.abs(end)) == pytest.approx(0.03)
    assert np.max(np.abs(end - begin)) == pytest.approx(0.8 * PERIOD)


def test_what_a_limit_took_away_reaches_the_state_through_m() -> None:
    plan, seen = some_plan(), noise(2, 0.3)
    limits = Limits(1e15, 0.5, -1e15, 1e15)
    deaf = plan._replace(gains=[plan.gains[0]._replace(M=[[0.0] * CABLES] * STATES)])
    informed, uninformed = walked(plan, limits, seen)[2], walked(deaf, limits, seen)[2]
    memory, gains = walked(plan, limits, seen)[1], plan.gains[0]
    away = np.array(memory.begin) - plan.speeds[1]
    asked = np.array(gains.C) @ memory.state + np.array(gains.D) @ away
    given = (np.array(memory.end) - plan.speeds[2] - away) / PERIOD
    assert np.max(np.abs(asked - given)) > 0.1
    assert np.array(informed.state) - uninformed.state == pytest.approx(np.array(gains.M) @ (given - asked))


def test_cable_at_its_highest_tension_is_let_out_and_at_its_lowest_reeled_in() -> None:
    plan = some_plan()._replace(speeds=[[0.0] * CABLES] * 60, expected=[[0.0] * 3 + [1000.0] * CABLES] * 60)
    silent = plan._replace(gains=[Gains([], [], [[]] * CABLES, (-np.eye(CABLES) / PERIOD).tolist(), [])])
    seen = np.zeros((40, 6))
    seen[:, 3], seen[:, 4] = 300.0, -300.0
    end = np.array([m.end for m in walked(silent, Limits(1e15, 1e15, 800.0, 1200.0), seen)])
    assert np.all(np.diff(end[3:, 0]) < 0.0) and np.all(np.diff(end[3:, 1]) > 0.0)
    assert np.all(end[:, 2] == 0.0)
    # 100 N too much: h (l / E S) (L - T) / tau^2 each sample.
    assert np.diff(end[3:, 0]) == pytest.approx(PERIOD * 1e-5 * -100.0 / 0.06**2)


def test_gains_between_knots_lie_on_straight_lines() -> None:
    plan = some_plan(knots=3)
    assert plan.knots == [0.0, 15.0, 30.0]
    first, second = plan.gains[0], plan.gains[1]
    for name in Gains._fields:
        mixed = 0.8 * np.array(getattr(first, name)) + 0.2 * np.array(getattr(second, name))
        assert np.array(getattr(gains_at(plan, 3), name)) == pytest.approx(mixed)
    assert np.array_equal(gains_at(plan, 15).A, plan.gains[1].A)
    assert gains_at(plan, 1000) is plan.gains[2]
    assert gains_at(plan._replace(knots=[5.0, 15.0, 30.0]), 2) is plan.gains[0]


def test_path_rests_at_its_last_sample() -> None:
    plan = some_plan(samples=10)
    longer = plan._replace(speeds=[*plan.speeds, plan.speeds[-1]], expected=[*plan.expected, plan.expected[-1]])
    seen = noise(30, 1e-2)
    assert walked(plan, FREE, seen)[-1] == walked(longer, FREE, seen)[-1]


def test_first_tensions_scale_those_to_come_and_what_cancels_stretch() -> None:
    samples, random = 30, np.random.default_rng(9)
    # The first ramp begins before anything is seen.
    stretches = 0.01 * random.standard_normal((samples, CABLES)) * (np.arange(samples) > 1)[:, None]
    tensions = random.uniform(500.0, 900.0, (samples, CABLES))
    expected = np.hstack([np.ones((samples, 3)), tensions]).tolist()
    rest = tensions[0].tolist()
    plan = some_plan(samples)._replace(stretches=stretches.tolist(), expected=expected, at_rest=rest, tares=True)
    scales = np.array([1.2, 1.0, 0.8])
    truth = plan._replace(
        stretches=(scales * stretches).tolist(),
        expected=np.hstack([np.ones((samples, 3)), scales * tensions]).tolist(),
        tares=False,
    )
    seen = noise(samples - 1, 1e-3)
    seen[0] = 0.0
    tared = walked(plan, FREE, seen + np.hstack([np.zeros((29, 3)), (scales - 1.0) * tensions[:29]]))
    known = walked(truth, FREE, seen)
    assert tared[-1].end == pytest.approx(known[-1].end)
    assert tared[-1].state == pytest.approx(known[-1].state)
    assert tared[5].scales == pytest.approx(scales)


def test_tare_is_bounded_and_leaves_slack_cables_alone() -> None:
    plan = some_plan()._replace(at_rest=[100.0, 100.0, 0.0], tares=True)
    memory = next_controller_state(plan, FREE, initial_controller_state(plan, FREE), [0.0] * 3 + [1.0, 900.0, 5.0])
    assert memory.scales == [0.5, 2.0, 1.0]


def test_tensions_other_than_expected_at_the_start_are_no_rise() -> None:
    plan = some_plan()._replace(speeds=[[0.0] * CABLES] * 60, expected=[[0.0] * 3 + [1000.0] * CABLES] * 60)
    silent = plan._replace(gains=[Gains([], [], [[]] * CABLES, (-np.eye(CABLES) / PERIOD).tolist(), [])])
    seen = np.zeros((5, 6))
    seen[:, 3:] = -400.0
    assert np.all(np.array([m.end for m in walked(silent, Limits(1e15, 1e15, 0.0, 1e15), seen)]) == 0.0)
