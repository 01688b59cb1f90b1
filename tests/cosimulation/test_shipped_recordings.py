"""Shipped recordings: what remakes them, and a co-simulation of the same robot, which shares no code with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import EffectSetting, Robot
from tests.rig.ship import EXAMPLES, SHIPMENTS, Shipment, make


def completed(shipment: Shipment) -> Robot:
    """The shipped robot with what its file does not say, as effects."""
    robot = read_robot(EXAMPLES / shipment.name / "robot.toml")
    for name, values in shipment.effects.items():
        assert not isinstance(values, list | tuple)
        cables = robot.cable_numbers if name == "damping" else ()
        robot = robot.with_effect(EffectSetting(name, dict(values), cables))
    return robot


@pytest.mark.validate
@pytest.mark.parametrize("shipment", SHIPMENTS, ids=lambda shipment: shipment.name)
def test_the_co_simulation_makes_the_same_motion(shipment: Shipment, tmp_path: Path) -> None:
    brief = replace(shipment, duration=40.0 / shipment.rate)
    true = make(brief, "check", noise=False)
    numbers = range(1, completed(brief).cable_count + 1)
    time, speeds, tensions, positions = (
        true[names].to_numpy()
        for names in (
            "time",
            [f"winch_speed_{i}" for i in numbers],
            [f"tension_{i}" for i in numbers],
            list("xyz"),
        )
    )
    motion = cosimulate(build_fmus(completed(brief), tmp_path, native=True), time, speeds, step=0.1 / shipment.rate)
    assert np.max(np.abs(motion.position - positions)) < 1e-8
    assert np.max(np.abs(motion.tension - tensions)) < 1e-7 * np.max(tensions)
    if "qw" in true:
        assert motion.orientation is not None
        turned = np.sum(motion.orientation * true[["qw", "qx", "qy", "qz"]].to_numpy(), axis=1)
        assert np.max(np.abs(np.abs(turned) - 1.0)) < 1e-12
    assert np.max(np.ptp(tensions, axis=0)) > 1e-4 * np.max(tensions)


@pytest.mark.validate
def test_the_shipped_files_are_what_it_makes() -> None:
    """Those of the README; the others are made in the same way."""
    (shipment,) = (each for each in SHIPMENTS if each.name == "three")
    shipped, made = pd.read_csv(EXAMPLES / shipment.name / "fit.csv"), make(shipment, "fit")
    assert list(shipped) == list(made)
    assert np.max(np.abs(shipped - made) / made.abs().max()) < 2e-6
