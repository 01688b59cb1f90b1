"""What outputs will be at the end of a step, from their past."""

from collections.abc import Callable

import numpy as np
import pytest

from tautwire.cosimulation.convergence import InterpolationErrorEstimate
from tautwire.cosimulation.extrapolation import Extrapolator, restart_history
from tautwire.cosimulation.hermite_interpolation import DerivativeChain

STEP = 0.1
# Value, rate and its rate, each at the end and in the middle of a step.
CHAIN = DerivativeChain((0, 1, 2), (3, 4, 5))
VALUE_ONLY = DerivativeChain((0,), None)


def swing(time: float, frequency: float = 10.0) -> list[float]:
    phase = frequency * time
    return [np.sin(phase), frequency * np.cos(phase), -(frequency**2) * np.sin(phase)]


def shown(motion: Callable[[float], list[float]], time: float) -> np.ndarray:
    return np.array([*motion(time), *motion(time - 0.5 * STEP)])


def misses(motion: Callable[[float], list[float]], steps: int, chain: DerivativeChain = CHAIN) -> list[float]:
    """Of each step in turn, the largest relative to the size of a swing's value and rates."""
    count = len(chain.ends) * (1 if chain.midpoints is None else 2)
    places = np.array([*chain.ends, *(chain.midpoints or ())])
    prediction = Extrapolator([chain], places, np.array([1.0, 10.0, 100.0] * 2)[:count])
    history = restart_history(0.0, shown(motion, 0.0))
    results = []
    for number in range(1, steps + 1):
        time = number * STEP
        expected, true = shown(motion, time - STEP), shown(motion, time)
        history = prediction.begin_step(history, time, expected)
        results.append(float(np.max(np.abs(expected - true)[places] / np.array([1.0, 10.0, 100.0] * 2)[:count])))
        history = prediction.end_step(history, time, true)
    return results


def test_a_parabola_is_known_from_one_point() -> None:
    assert max(misses(lambda time: [3.0 + time - 2.0 * time**2, 1.0 - 4.0 * time, -4.0], 4)) < 1e-12


def test_a_value_alone_is_extrapolated_from_three_points() -> None:
    result = misses(lambda time: [3.0 + time - 2.0 * time**2, 0.0, 0.0], 6, VALUE_ONLY)
    assert result[0] > 1e-3
    assert max(result[4:]) < 1e-12


def test_a_swing_is_known_better_the_longer_its_past_is() -> None:
    result = misses(swing, 20)
    assert result[0] > 0.05
    assert result[3] < 0.02 * result[0]


def test_what_the_polynomial_misses_of_a_swing_is_learnt() -> None:
    result = misses(swing, 20)
    assert max(result[12:]) < 1e-3 * result[3]


def test_what_rests_is_known_to_rest() -> None:
    assert max(misses(lambda time: [3.0, 0.0, 0.0], 12)) < 1e-14


def test_after_a_corner_only_what_follows_it_counts() -> None:
    def cornered(time: float) -> list[float]:
        late = max(time - 1.0, 0.0)
        return [a + b for a, b in zip(swing(time), [1e3 * late**3, 3e3 * late**2, 6e3 * late], strict=True)]

    result = misses(cornered, 20)
    assert result[10] > 1.0
    assert max(result[11:]) < 0.03 * result[10]


def test_a_corner_in_a_short_step_tells_nothing_about_a_time_far_ahead() -> None:
    jump, corner = np.array([0.0, 0.0, 1.0] * 2), 10 * STEP
    prediction = Extrapolator([CHAIN], np.arange(6), np.array([1.0, 10.0, 100.0] * 2))
    history = restart_history(0.0, shown(swing, 0.0))
    for time in np.arange(1, 11) * STEP:
        history = prediction.begin_step(history, time, np.zeros(6))
        history = prediction.end_step(history, time, shown(swing, time))
    history = prediction.begin_step(history, corner + 3e-6, np.zeros(6))
    history = prediction.end_step(history, corner + 3e-6, shown(swing, corner + 3e-6) + jump)
    expected = np.zeros(6)
    history = prediction.begin_step(history, corner + STEP, expected)
    assert np.max(np.abs(expected[:3] - swing(corner + STEP)) / [1.0, 10.0, 100.0]) < 0.5


def test_a_memory_taken_back_predicts_the_same() -> None:
    prediction = Extrapolator([CHAIN], np.arange(6), np.ones(6))
    history = restart_history(0.0, shown(swing, 0.0))
    for number in range(1, 10):
        history = prediction.begin_step(history, number * STEP, np.zeros(6))
        history = prediction.end_step(history, number * STEP, shown(swing, number * STEP))
    memory, found = history, []
    for _ in range(2):
        expected = np.zeros(6)
        history = prediction.begin_step(history, 10 * STEP, expected)
        history = prediction.end_step(history, 10 * STEP, shown(swing, 10 * STEP) + 1.0)
        found.append(expected)
        history = memory
    assert np.array_equal(found[0], found[1])


def test_a_quintic_has_no_error_at_mid_step() -> None:
    quintic = np.polynomial.Polynomial([1.0, -2.0, 3.0, 4.0, -5.0, 6.0])
    bends = InterpolationErrorEstimate([CHAIN, VALUE_ONLY], np.ones(6))
    begun, end = (shown(lambda at: [quintic.deriv(k)(at) for k in range(3)], time) for time in (0.2, 0.2 + STEP))
    assert bends.max_error(begun, end, STEP) < 1e-11


def test_the_error_at_mid_step_is_that_of_the_sixth_derivative() -> None:
    bends = InterpolationErrorEstimate([CHAIN], np.array([1.0, 1e9, 1e9, 1.0, 1e9, 1e9]))
    begun, end = (shown(lambda at: [at**6, 6.0 * at**5, 30.0 * at**4], time) for time in (0.0, STEP))
    assert bends.max_error(begun, end, STEP) == pytest.approx(720.0 * STEP**6 / 46080.0)
