"""Lifelike recordings of platforms that turn: designs, files, and what logs show of the orientation."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.rig import EFFECTS, Rig, StillProgram, load_robot
from tests.rig.lifelike.case import LEAST_RATIO, Case, lifelike
from tests.rig.lifelike.design import HIGHEST_MODE, TILT
from tests.rig.lifelike.hidden import HIDDEN_ON_PLATFORMS, ON_PLATFORMS, Site
from tests.rig.lifelike.little import little_of, no_little
from tests.rig.lifelike.platform_design import platform_design
from tests.rig.lifelike.recording import Lot, Session
from tests.rig.lifelike.sensors import Memory, Tracker
from tests.rig.lifelike.survey import FURTHEST, NOTHING_UNKNOWN, robot_file, survey_of, true_robot
from tests.rig.modes import frequencies_of
from tests.rig.turning import cayley

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def chance(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def lot_of(seed: int, cables: int, **others: Any) -> Lot:
    random = chance(seed)
    made = platform_design(random, cables)
    survey = survey_of(random, made)
    little = replace(little_of(random, made, survey, ()), **others)
    return Lot(made, survey, true_robot(random, made, survey), little)


@pytest.fixture(scope="module")
def short() -> Case:
    return lifelike(5, ["rotational_drag"], cables=8, duration=3.0, rate=50.0, turning=True, exact=True)


@pytest.mark.validate
@pytest.mark.parametrize("cables", [4, 8])
def test_platforms_rest_at_their_start_and_have_modes_that_fixed_steps_follow(cables: int) -> None:
    for seed in range(4):
        made = platform_design(chance(seed), cables)
        assert made.robot.body is not None and made.robot.count == cables
        assert frequencies_of(made.robot).max() < HIGHEST_MODE
        rig = Rig(made.robot, {}, StillProgram(cables))
        assert np.abs(rig.evaluate(0.0, rig.begin()).rates).max() < 1e-6
        assert rig.turning is not None
        assert rig.turning.start == pytest.approx(made.robot.body.orientation, abs=1e-9)
        assert rig.start_tension.min() > 0.0


@pytest.mark.parametrize("cables", [4, 8])
def test_the_file_is_the_robot(cables: int, tmp_path: Path) -> None:
    lot = lot_of(3, cables)
    text = robot_file(lot.design, lot.survey, "made")
    (tmp_path / "robot.toml").write_text(text, encoding="utf-8")
    read, made = load_robot(tmp_path / "robot.toml"), lot.design.robot
    assert read.body is not None and made.body is not None
    for name in ("inertia", "centre", "attachments", "orientation"):
        assert getattr(read.body, name) == pytest.approx(getattr(made.body, name), abs=1e-12)
    assert read.noise == made.noise
    content = tomllib.loads(text)
    assert ("tension" in content) == (cables > 6)
    stated = content["cable"][0]["attachment_uncertainty"], content["platform"]["centre_of_mass_uncertainty"]
    assert stated == (lot.survey.attachment, lot.survey.centre) and min(stated) > 0.0
    assert content["platform"]["inertia_uncertainty"] > 0.0


def test_the_true_platform_lies_within_what_the_file_says() -> None:
    made = platform_design(chance(2), 8)
    survey = survey_of(chance(3), made)
    drawn = [true_robot(chance(seed), made, survey).robot.body for seed in range(200)]
    assert made.robot.body is not None
    shifts = np.array([body.attachments - made.robot.body.attachments for body in drawn if body])
    assert shifts.std() == pytest.approx(0.88 * survey.attachment, rel=0.1)
    assert np.abs(shifts).max() <= FURTHEST * survey.attachment * (1 + 1e-9)
    centres = np.array([body.centre - made.robot.body.centre for body in drawn if body])
    assert centres.std() == pytest.approx(0.88 * survey.centre, rel=0.15)
    moments = np.array([np.linalg.eigvalsh(body.inertia) for body in drawn if body])
    deviation = survey.inertia * np.linalg.eigvalsh(made.robot.body.inertia).mean()
    assert np.abs(moments - np.linalg.eigvalsh(made.robot.body.inertia)).max() <= FURTHEST * deviation * (1 + 1e-9)


def test_platforms_turn_as_far_as_they_are_led() -> None:
    made = platform_design(chance(1), 8)
    program = made.program(7)
    turned = [np.linalg.norm(program.pose(time)[0][3:]) for time in np.linspace(0.0, 60.0, 200)]  # type: ignore[attr-defined]
    assert 0.1 * TILT < 2.0 * max(turned) < 1.5 * TILT


@pytest.mark.validate
@pytest.mark.parametrize("cables", [4, 8])
def test_a_log_shows_the_orientation_with_the_trackers_noise_and_gaps(cables: int) -> None:
    lot = lot_of(4, cables, tracker=Tracker(dropouts=120.0), place=Memory(0.0, 1.0))
    session = Session(lot, 1, 4.0, 50.0)
    happened = session.outputs({})
    frame = session.log(happened)
    seen = np.isfinite(frame["x"].to_numpy())
    assert 0 < seen.sum() < len(frame)
    columns = frame[["qx", "qy", "qz", "qw"]].to_numpy()
    assert np.array_equal(np.isfinite(columns).all(axis=1), seen)
    assert happened.rotation is not None
    errors = Rotation.from_quat(columns[seen]) * Rotation.from_matrix(happened.rotation[seen]).inv()
    assert errors.as_rotvec().std() == pytest.approx(lot.design.robot.noise.orientation, rel=0.15)


@pytest.mark.validate
def test_little_things_turn_a_platform_too() -> None:
    lot = lot_of(4, 8)
    session = Session(lot, 1, 2.0, 50.0)
    shaken, still = session.outputs({}), session.outputs({}, little=False)
    assert shaken.rotation is not None and still.rotation is not None
    turned = (Rotation.from_matrix(shaken.rotation) * Rotation.from_matrix(still.rotation).inv()).magnitude()
    assert 1e-7 < turned.max() < 0.02
    # Angles count by the size of the platform.
    angle = Rotation.from_rotvec([1e-3, 0.0, 0.0]).as_matrix()
    aside = replace(still, rotation=angle @ still.rotation)
    assert aside.apart(still)[0] == pytest.approx(1e-3 * lot.design.size / np.sqrt(3.0), rel=1e-6)


def test_everything_hidden_on_platforms_is_an_effect_of_the_rig() -> None:
    lot = lot_of(1, 8)
    site = Site(lot.design, lot.survey, 2, 1.0, 40.0, chance())
    for part in HIDDEN_ON_PLATFORMS.values():
        made = EFFECTS[part.name](**part.settings(part.least, site))
        assert part not in ON_PLATFORMS or not made.of_points
    listed = {part.name for part in ON_PLATFORMS if part.manner == "right"}
    assert listed - {"payload", "transverse_damping"} == {name for name, effect in EFFECTS.items() if effect.of_bodies}


@pytest.mark.validate
def test_an_exact_case_differs_from_its_file_by_the_hidden_thing_alone(short: Case) -> None:
    assert short.truth["effect"] == "rotational_drag"
    assert short.truth["size_of_hidden_rms"]["check"][0] > LEAST_RATIO * short.truth["size_of_little_rms"]["check"][0]
    assert "little" in short.truth and not short.truth["little"].get("force_rms")
    assert not np.any(short.truth["robot"]["attachment"]) and not np.any(short.truth["robot"]["anchor"])
    content = tomllib.loads(short.robot_file)
    assert content["cable"][0]["anchor_uncertainty"] == content["platform"]["inertia_uncertainty"] == 0.0
    frame = short.recordings["fit"]
    assert len(frame) == 151 and frame[["qw", "qx", "qy", "qz"]].notna().all().all()
    assert not NOTHING_UNKNOWN.inertia and not no_little().names


def test_designs_state_their_start_as_a_rotation() -> None:
    body = platform_design(chance(6), 4).robot.body
    assert body is not None
    assert body.orientation @ body.orientation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert body.orientation != pytest.approx(cayley(np.zeros(3)), abs=1e-4)
