"""What a residual moves with: named where it is sure, and only there."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from tautwire.estimation.localisation.component_residuals import strongest_correlation

Array = NDArray[np.float64]


def coloured(seed: int, memory: float = 0.98, count: int = 4000) -> Array:
    """Noise that remembers."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, count)
    values: Array = lfilter([1.0], [1.0, -memory], noise)
    return values


def test_the_signal_that_a_residual_follows_is_named() -> None:
    speed, place = coloured(1), coloured(2)
    residual = 0.3 * speed + coloured(3, 0.5)
    correlation = strongest_correlation(residual, {"place": place, "speed": speed})
    assert correlation is not None and correlation.name == "speed"
    assert correlation.correlation == pytest.approx(np.corrcoef(residual, speed)[0, 1])


def test_of_several_the_strongest_is_named() -> None:
    one = coloured(4)
    other = one + 0.5 * coloured(5)
    correlation = strongest_correlation(-one + 0.1 * coloured(6), {"other": other, "one": one})
    assert correlation is not None and correlation.name == "one"
    assert correlation.correlation < -0.9


def test_slow_signals_that_have_nothing_to_do_with_each_other_are_rarely_named() -> None:
    named = [
        strongest_correlation(coloured(seed), {f"{k}": coloured(10_000 + 7 * seed + k) for k in range(6)})
        for seed in range(60)
    ]
    assert sum(found is not None for found in named) <= 3


def test_signals_that_stand_still_and_gaps_do_no_harm() -> None:
    speed = coloured(8)
    residual = speed.copy()
    residual[100:900] = np.nan
    correlation = strongest_correlation(residual, {"still": np.full(len(speed), 3.7), "speed": speed})
    assert correlation is not None and correlation.name == "speed"
    assert strongest_correlation(residual, {"still": np.zeros(len(speed))}) is None
    assert strongest_correlation(np.full(4000, np.nan), {"speed": speed}) is None
