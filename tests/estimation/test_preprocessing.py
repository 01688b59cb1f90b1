"""Recordings as a trace takes them: as they are first, where a clock would explain only a part."""

from dataclasses import replace
from typing import Any

import pytest

from tautwire.estimation import preprocessing, trace
from tautwire.estimation.clock_offsets import CHANNEL_GROUPS, shifted
from tautwire.estimation.estimation_data import DataSplit
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.preprocessing import PreparedData, prepare_data
from tautwire.estimation.preprocessing_policy import ClockOffsetPolicy
from tautwire.estimation.worker_pool import WorkerPool
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot
from tests.support.recordings import recorded
from tests.support.robots import example

THREE = example("three")
LATE: dict[str, Any] = {"sensor_delay": {"seconds": 0.015, "outputs": "position"}}
PAYLOAD: dict[str, Any] = {"payload": {"mass": 1.5}}


def read(fit: dict[str, Any], check: dict[str, Any]) -> tuple[PreparedData, ...]:
    return prepare_data(THREE, recorded("three", 1, fit), recorded("three", 2, check), WorkerPool(1))


def told(found: PreparedData) -> bool:
    return any("a clock offset" in note for note in found.notes)


def test_what_is_noise_is_taken_as_it_is() -> None:
    (found,) = read({}, {})
    assert not told(found)


def test_a_clock_that_explains_all_is_set_at_once() -> None:
    (found,) = read(LATE, {})
    assert told(found)


def test_a_clock_that_leaves_more_than_noise_waits_behind_the_recordings_as_they_are() -> None:
    first, second = read({**PAYLOAD, **LATE}, PAYLOAD)
    assert not told(first) and told(second)
    assert first.split.estimation.recording is recorded("three", 1, {**PAYLOAD, **LATE})
    assert second.split.estimation.recording is not first.split.estimation.recording


@pytest.mark.validate
def test_an_effect_that_explains_all_goes_before_a_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    def always(
        fitter: Fitter, robot: Robot, evidence: DataSplit, policy: ClockOffsetPolicy
    ) -> tuple[DataSplit, tuple[str, ...]]:
        late = shifted(evidence.estimation.recording, 0.01, CHANNEL_GROUPS[1])
        return DataSplit(replace(evidence.estimation, recording=late), evidence.validation, ()), ("a clock offset",)

    monkeypatch.setattr(preprocessing, "with_clocks_set", always)
    found = trace(THREE, *pair({"damping": {"damping": 9e8}}))
    assert [effect.name for effect in found.effects] == ["damping"]
    assert not any("clock" in note for note in found.notes)


@pytest.mark.validate
def test_a_clock_beside_an_effect_is_set_once_no_effect_explains_all() -> None:
    found = trace(THREE, recorded("three", 1, {"payload": {"mass": 6.0}, **LATE}), pair({"payload": {"mass": 6.0}})[1])
    assert [effect.name for effect in found.effects] == ["payload"]
    assert any("a clock offset" in note for note in found.notes)


def pair(effects: dict[str, Any]) -> tuple[Recording, Recording]:
    return recorded("three", 1, effects), recorded("three", 2, effects)
