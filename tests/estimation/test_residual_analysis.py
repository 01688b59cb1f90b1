import numpy as np
import pytest

from tautwire.estimation.innovations import Innovations
from tautwire.estimation.residual_analysis import has_enough_samples, largest_autocorrelations, residuals_are_white


def innovations(values: np.ndarray, seen: np.ndarray | None = None) -> Innovations:
    there = np.isfinite(values) if seen is None else seen
    return Innovations(there, values, np.zeros((*values.shape, 0)), np.zeros_like(values))


def judged(values: np.ndarray, seen: np.ndarray | None = None) -> bool:
    return residuals_are_white(innovations(values, seen), np.ones(len(values), dtype=bool))


def white(seed: int, count: int = 1000) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, 6))


def test_noise_is_noise() -> None:
    assert sum(judged(white(seed)) for seed in range(200)) >= 199


TONE = np.sin(np.arange(1000) * 0.05)[:, None]


@pytest.mark.parametrize(
    "values",
    [
        1.12 * white(1),
        white(2) * [1.3, 1.0, 1.0, 1.0, 1.0, 1.0],
        white(3) + 0.5 * TONE,
        white(4) + 1.2 * TONE * [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        0.9 * (white(5)[1:] + 0.35 * white(5)[:-1]),
    ],
    ids=["all larger", "one larger", "a tone in all", "a tone in one", "alike from sample to sample"],
)
def test_what_is_larger_or_alike_is_not(values: np.ndarray) -> None:
    assert not judged(values)


def test_a_measured_cell_without_a_finite_innovation_is_not_noise() -> None:
    values = white(6)
    values[500, 2] = np.nan
    assert judged(values)
    assert not judged(values, np.ones_like(values, dtype=bool))


def test_a_hundred_samples_are_the_least() -> None:
    rows = np.ones(150, dtype=bool)
    assert has_enough_samples(innovations(white(7, 150)), rows)
    assert not has_enough_samples(innovations(white(7, 150)), np.arange(150) < 99)


def largest(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return largest_autocorrelations(innovations(values), np.ones(len(values), dtype=bool))


def test_noise_is_like_itself_no_more_than_chance_says() -> None:
    found = [largest(white(seed)) for seed in range(200)]
    assert np.mean([one < other for one, other in found]) == pytest.approx(0.95, abs=0.03)


def test_the_largest_autocorrelation_is_that_of_what_is_alike() -> None:
    values = white(6, 100_000)
    values[7:, 2] += 0.75 * values[:-7, 2]
    values[:, 3] = np.nan
    found, of_noise = largest(values)
    assert found[2] == pytest.approx(0.75 / (1.0 + 0.75**2), abs=0.02)
    assert np.isnan(found[3]) and np.isnan(of_noise[3])
    assert np.all(found[[0, 1, 4, 5]] < 2.0 * of_noise[[0, 1, 4, 5]])
