"""Samples in common: copies are recognised through digits, parts and strides; repeated motions are not copies."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tautwire.recordings.recording import recording_from_frame
from tautwire.recordings.shared_samples import shared_sample_count

COUNT, AT_REST = 600, 100
NOISE = {"position": 1e-4, "tension": 0.5}


def motion(seed: int, noise: float = 1.0) -> pd.DataFrame:
    """One path of a robot with three cables, at rest first, measured with noise of its own."""
    random = np.random.default_rng(seed)
    time = 0.01 * np.arange(COUNT)
    moved = np.maximum(time - 0.01 * AT_REST, 0.0)
    outputs = {axis: np.sin((k + 1) * moved) for k, axis in enumerate("xyz")}
    outputs |= {f"tension_{k}": 100.0 + 20.0 * np.cos(k * moved) for k in (1, 2, 3)}
    for name in outputs:
        sigma = NOISE["tension" if name.startswith("tension") else "position"]
        outputs[name] = outputs[name] + noise * sigma * random.standard_normal(COUNT)
    speeds = {f"winch_speed_{k}": 0.1 * np.sin(k * moved) for k in (1, 2, 3)}
    return pd.DataFrame({"time": time, **speeds, **outputs})


def shared(check: pd.DataFrame, fit: pd.DataFrame) -> int:
    return shared_sample_count(recording_from_frame(check, 3), recording_from_frame(fit, 3))


def test_a_copy_has_all_its_samples_in_common() -> None:
    assert shared(motion(1), motion(1)) == COUNT


@pytest.mark.parametrize("digits", [5, 6])
def test_a_copy_with_fewer_digits_is_a_copy(digits: int) -> None:
    assert shared(motion(1).round(digits), motion(1)) > 0.9 * COUNT


def test_a_part_and_every_second_row_are_copies_on_a_clock_of_their_own() -> None:
    part = motion(1)[200:400].assign(time=lambda table: table["time"] - 2.0)
    assert shared(part, motion(1)) == 200
    assert shared(motion(1)[::2], motion(1)) == COUNT // 2
    joined = pd.concat([motion(2)[:300], motion(1)[300:]])
    assert shared(joined, motion(1)) == 300


def test_a_sensor_with_a_lower_rate_is_compared_where_it_measured() -> None:
    slow = motion(1)
    slow.loc[slow.index % 4 > 0, ["x", "y", "z"]] = np.nan
    assert shared(slow, slow) == COUNT


def test_the_same_motion_measured_again_is_no_copy() -> None:
    assert shared(motion(2), motion(1)) < 0.02 * COUNT
    assert shared(motion(2).round(4), motion(1).round(4)) < 0.02 * COUNT


def test_a_rest_without_noise_is_no_copy_of_another_rest() -> None:
    other = motion(2, noise=0.0)
    other.loc[AT_REST:, ["x", "y", "z"]] *= 1.1
    assert shared(other, motion(1, noise=0.0)) < 0.02 * COUNT


def test_values_that_recur_at_rest_are_no_copies() -> None:
    """Two coordinates alone, in steps as wide as their noise."""
    first, second = (
        motion(seed).assign(**dict.fromkeys(("z", "tension_1", "tension_2", "tension_3"), np.nan)) for seed in (1, 2)
    )
    at_rest = [table[:AT_REST].round(4) for table in (first, second)]
    assert shared(*at_rest) < 0.1 * AT_REST


def test_recordings_of_different_outputs_have_nothing_in_common() -> None:
    tensions = motion(1).drop(columns=["x", "y", "z"])
    positions = motion(1).drop(columns=["tension_1", "tension_2", "tension_3"])
    assert shared(tensions, positions) == 0
