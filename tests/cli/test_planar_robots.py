"""A planar robot on four cables of which positions alone were measured, traced by the command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from tautwire import estimation
from tautwire.cli import run
from tests.support.planar import HORIZONTAL, VERTICAL, planar_case

pytestmark = pytest.mark.validate

DURATION = 6.0  # s


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers of its own would compile the same again beside the other tests."""
    monkeypatch.setattr(estimation, "processors", lambda: 1)


def traced(paths: list[Path]) -> dict[str, Any]:
    robot, fit, check = map(str, paths)
    out = paths[0].parent / "report"
    assert run(["trace", robot, fit, "--check", check, "--out", str(out)]) == 0
    report: dict[str, Any] = json.loads((out / "report.json").read_text())
    return report


def assert_reached(report: dict[str, Any]) -> None:
    for role in ("fit", "check"):
        assert report["error_after"][role]["position_rms"] < 1.2 * report["noise_floor"]["position_rms"]
        assert report["error_after"][role]["tension_rms"] is None


def test_a_pretension_that_is_not_the_preferred_one_is_no_effect(tmp_path: Path) -> None:
    report = traced(planar_case(tmp_path, HORIZONTAL, {}, 1, preferred=60.0, duration=DURATION))
    assert report["verdict"] == "none"
    assert_reached(report)
    assert any("a wrong pretension is not taken for one" in note for note in report["notes"])
    note_text = next(note for note in report["notes"] if "fit.csv: the estimated initial state has tensions of" in note)
    tensions = [float(value) for value in note_text.split(" tensions of ")[1].split(" N")[0].split(", ")]
    assert sum(tensions) / 4 == pytest.approx(60.0, rel=0.1)


def test_a_platform_that_is_lighter_than_declared_is_named_and_measured(tmp_path: Path) -> None:
    report = traced(planar_case(tmp_path, VERTICAL, {"payload": {"mass": -1.0}}, 1, preferred=30.0, duration=DURATION))
    assert [effect["name"] for effect in report["effects"]] == ["payload"]
    assert report["effects"][0]["parameters"]["mass"]["value"] == pytest.approx(-1.0, rel=0.02)
    assert_reached(report)


def test_one_coordinate_is_enough(tmp_path: Path) -> None:
    paths = planar_case(tmp_path, VERTICAL, {"payload": {"mass": 1.0}}, 1, duration=DURATION)
    for path in paths[1:]:
        pd.read_csv(path).drop(columns="x").to_csv(path, index=False)
    report = traced(paths)
    assert [effect["name"] for effect in report["effects"]] == ["payload"]
    assert report["effects"][0]["parameters"]["mass"]["value"] == pytest.approx(1.0, rel=0.05)
