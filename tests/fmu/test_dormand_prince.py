"""Inner steps against solutions in closed form: smooth, fast and bent."""

from __future__ import annotations

import math

import pytest

from tautwire_fmu.dormand_prince import integrate_dormand_prince


def test_a_smooth_state_is_exact_to_the_tolerance() -> None:
    middle, end = integrate_dormand_prince(lambda f, s: [math.cos(0.5 * f)], [0.0], [1.0], 0.5)
    assert end[0] == pytest.approx(math.sin(0.5), abs=1e-8)
    assert middle[0] == pytest.approx(math.sin(0.25), abs=1e-4)


@pytest.mark.parametrize("time", [1e-1, 1e-3, 1e-5])
def test_a_fast_state_follows_its_input(time: float) -> None:
    """``e' = (t - e) / tau`` from rest: ``e = t - tau (1 - exp(-t / tau))``."""
    step = 0.01
    middle, end = integrate_dormand_prince(lambda f, s: [(f * step - s[0]) / time], [0.0], [1.0], step)
    for found, at in ((middle, 0.5 * step), (end, step)):
        assert found[0] == pytest.approx(at + time * math.expm1(-at / time), abs=3e-7)


def test_a_larger_tolerance_takes_fewer_inner_steps() -> None:
    def error_and_calls(relative_tolerance: float) -> tuple[float, int]:
        calls = []

        def rates(fraction: float, states: list[float]) -> list[float]:
            calls.append(fraction)
            return [-20.0 * states[0]]

        _, end = integrate_dormand_prince(rates, [1.0], [1.0], 1.0, relative_tolerance)
        return abs(end[0] - math.exp(-20.0)), len(calls)

    fine, coarse = error_and_calls(1e-9), error_and_calls(1e-5)
    assert fine[0] < 1e-8
    assert coarse[0] < 1e-4
    assert coarse[1] < 0.5 * fine[1]


@pytest.mark.parametrize("corner", [0.1, 0.3, 0.5, 0.77])
def test_a_bend_inside_the_step_costs_no_accuracy(corner: float) -> None:
    calls = []

    def rates(fraction: float, states: list[float]) -> list[float]:
        calls.append(fraction)
        return [100.0 * max(0.0, fraction - corner)]

    _, end = integrate_dormand_prince(rates, [0.0], [1.0], 0.01)
    assert end[0] == pytest.approx(0.5 * (1.0 - corner) ** 2, abs=1e-7)
    assert len(calls) < 300
    assert min(calls) == 0.0 and max(calls) <= 1.0


def test_the_same_arguments_give_the_same_bits() -> None:
    def rates(fraction: float, states: list[float]) -> list[float]:
        return [states[1], -1e6 * states[0] + abs(math.sin(700.0 * fraction))]

    assert integrate_dormand_prince(rates, [1.0, 0.0], [1.0, 1e3], 0.01) == integrate_dormand_prince(
        rates, [1.0, 0.0], [1.0, 1e3], 0.01
    )


def test_states_that_rest_take_one_step() -> None:
    calls = []

    def rates(fraction: float, states: list[float]) -> list[float]:
        calls.append(fraction)
        return [0.0, 0.0]

    assert integrate_dormand_prince(rates, [1.0, 2.0], [1.0, 1.0], 0.01) == ([1.0, 2.0], [1.0, 2.0])
    assert len(calls) == 7


def test_a_rate_that_is_no_number_ends() -> None:
    _, end = integrate_dormand_prince(lambda f, s: [math.nan], [0.0], [1.0], 0.01)
    assert math.isnan(end[0])
