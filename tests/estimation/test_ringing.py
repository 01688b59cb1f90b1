"""A residual force that rings by itself is told from one that follows the motion."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from tautwire.estimation.residual_spectrum import resonance_frequency

Array = NDArray[np.float64]

STEP = 0.01
TIME = np.arange(0.0, 30.0, STEP)
CUTOFF = 8.0


def shaken(seed: int) -> Array:
    """Accelerations of a motion that slowly wanders."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, len(TIME))
    values: Array = lfilter([STEP], [1.0, -0.9], noise)
    return values


def swinging(acceleration: Array, frequency: float, damping: float = 0.01) -> Array:
    """The force of a body of 1 kg that swings on a carrier moved so."""
    omega = 2.0 * np.pi * frequency
    place, speed, forces = 0.0, 0.0, np.empty(len(acceleration))
    for row, pushed in enumerate(acceleration):
        pull = -(omega**2) * place - 2.0 * damping * omega * speed
        forces[row] = -pull
        speed += STEP * (pull - pushed)
        place += STEP * speed
    return forces


@pytest.mark.parametrize("frequency", [0.45, 0.8])
def test_a_body_that_swings_is_found_with_its_frequency(frequency: float) -> None:
    acceleration = shaken(1)
    force = swinging(acceleration, frequency)
    force[700:760] = np.nan
    assert resonance_frequency(TIME, force, acceleration, CUTOFF) == pytest.approx(frequency, rel=0.05)


def test_a_weight_and_a_brake_do_not_ring() -> None:
    for seed in range(8):
        acceleration = shaken(seed)
        noise = np.random.default_rng(100 + seed).normal(0.0, 0.01, len(TIME))
        assert resonance_frequency(TIME, 3.0 * acceleration + noise, acceleration, CUTOFF) is None
        assert resonance_frequency(TIME, STEP * np.cumsum(acceleration) + noise, acceleration, CUTOFF) is None


def test_too_little_says_nothing() -> None:
    acceleration = shaken(2)
    assert resonance_frequency(TIME[:40], acceleration[:40], acceleration[:40], CUTOFF) is None
    assert resonance_frequency(TIME, np.full(len(TIME), np.nan), acceleration, CUTOFF) is None
    assert resonance_frequency(TIME, acceleration, np.zeros(len(TIME)), CUTOFF) is None
