"""Shipped recordings of platforms that turn: two programs, two forms of the equations, one motion."""

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
from tests.rig.ship_platforms import EXAMPLES, SHIPMENTS, Shipment, declared, make, true_flight


def completed(shipment: Shipment) -> Robot:
    """The shipped robot with what its file does not say, as effects."""
    robot = read_robot(EXAMPLES / shipment.name / "robot.toml")
    if shipment.payload:
        at = np.subtract(shipment.carried_at, robot.platform.centre_of_mass).tolist()
        values = {"mass": shipment.payload, **dict(zip("xyz", at, strict=True))}
        robot = robot.with_effect(EffectSetting("payload", values))
    if any(shipment.shifted):
        shift = dict(zip("xyz", shipment.shifted, strict=True))
        robot = robot.with_effect(EffectSetting("centre_of_mass", shift))
    cables = tuple(replace(each, damping=shipment.damping * each.damping) for each in robot.cables)
    return replace(robot, cables=cables)


@pytest.mark.validate(but=["fast"])
@pytest.mark.parametrize("shipment", SHIPMENTS, ids=lambda shipment: shipment.name)
def test_the_co_simulation_makes_the_same_motion(shipment: Shipment, tmp_path: Path) -> None:
    brief = replace(shipment, duration=40.0 / shipment.rate)
    true = true_flight(brief, "check", declared(brief))
    step = 0.1 / shipment.rate
    motion = cosimulate(build_fmus(completed(brief), tmp_path), true.times, true.speeds, step=step)
    assert np.max(np.abs(motion.position - true.positions)) < 1e-9
    assert motion.orientation is not None
    assert np.max(np.abs(np.abs(np.sum(motion.orientation * true.orientations, axis=1)) - 1.0)) < 1e-12
    assert np.max(np.abs(motion.tension - true.tensions)) < 1e-8 * np.max(true.tensions)
    assert np.ptp(true.tensions, axis=0).max() > 1e-4 * np.max(true.tensions)


@pytest.mark.validate
@pytest.mark.parametrize("shipment", SHIPMENTS, ids=lambda shipment: shipment.name)
def test_the_shipped_files_are_what_it_makes(shipment: Shipment) -> None:
    shipped = pd.read_csv(EXAMPLES / shipment.name / "fit.csv")
    made = make(shipment, "fit")
    assert list(shipped) == list(made)
    assert np.max(np.abs(shipped - made) / made.abs().max()) < 2e-6
