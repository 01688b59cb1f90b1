"""Lines in the spectrum of innovations."""

import numpy as np
import pytest

from tautwire.estimation.innovations import Innovations
from tautwire.estimation.residual_spectrum import spectral_lines

TIME = np.arange(1500) / 50.0
EVERY = np.ones(1500, dtype=bool)


def innovations(seed: int, *lines: tuple[float, float]) -> Innovations:
    """Noise of one in three outputs, and lines of (Hz, amplitude) in the first."""
    values = np.random.default_rng(seed).normal(size=(1500, 3))
    for frequency, amplitude in lines:
        values[:, 0] += amplitude * np.sin(2.0 * np.pi * frequency * TIME + 0.7)
    return Innovations(np.ones((1500, 3), dtype=bool), values, np.zeros((1500, 3, 0)), np.zeros((1500, 3)))


def test_lines_are_found_strongest_first() -> None:
    found = spectral_lines(TIME, innovations(1, (1.713, 1.0), (4.2, 2.0)), EVERY)
    assert [pace / (2.0 * np.pi) for pace in found] == pytest.approx([4.2, 1.713], abs=0.01)


@pytest.mark.parametrize("seed", range(10))
def test_noise_has_none(seed: int) -> None:
    assert spectral_lines(TIME, innovations(seed), EVERY) == []


def test_samples_that_do_not_count_are_not_looked_at() -> None:
    mixed = innovations(2)
    mixed.values[750:, 0] += 3.0 * np.sin(2.0 * np.pi * 3.0 * TIME[750:])
    assert spectral_lines(TIME, mixed, TIME < 15.0) == []
    assert len(spectral_lines(TIME, mixed, TIME >= 15.0)) == 1
