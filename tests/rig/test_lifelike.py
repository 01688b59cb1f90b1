"""Lifelike recordings of the rig: chance, sizes, noise, and what the truth says of them."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.rig import EFFECTS, Rig, StillProgram, paper_robot, simulate, wander
from tests.rig.lifelike.case import LEAST_RATIO, Case, lifelike
from tests.rig.lifelike.design import HIGHEST_MODE, LEVELS, Design, design
from tests.rig.lifelike.hidden import HIDDEN, PAIRS, Site
from tests.rig.lifelike.little import CALLED, little_of
from tests.rig.lifelike.march import TabulatedProgram, march, steps_for
from tests.rig.lifelike.processes import ornstein_uhlenbeck, swaying
from tests.rig.lifelike.recording import Lot, Session
from tests.rig.lifelike.sensors import Memory, Tracker, counted, differentiated, drifting, noisy, tracked
from tests.rig.lifelike.surroundings import Belt, played
from tests.rig.lifelike.survey import FURTHEST, robot_file, survey_of, true_robot
from tests.rig.wander import natural_frequencies

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def chance(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def lot_of(seed: int, **others: Any) -> Lot:
    random = chance(seed)
    made = design(random, 3, False)
    survey = survey_of(random, made)
    little = replace(little_of(random, made, survey, ()), **others)
    return Lot(made, survey, true_robot(random, made, survey), little)


@pytest.fixture(scope="module")
def short() -> Case:
    return lifelike(3, ["friction-linear"], cables=3, planar=False, duration=6.0, rate=50.0)


def test_a_process_has_its_deviation_and_its_memory() -> None:
    values = ornstein_uhlenbeck(chance(), (40_000, 2), 0.01, 3.0, 0.5)
    assert values.std(axis=0) == pytest.approx(3.0, rel=0.1)
    assert np.corrcoef(values[:-10, 0], values[10:, 0])[0, 1] == pytest.approx(np.exp(-np.pi * 0.1), abs=0.03)
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.1


def test_a_frame_sways_from_rest_at_its_frequency() -> None:
    values = swaying(chance(), (100_000, 1), 0.01, 2e-3, 1.5)[:, 0]
    power = np.abs(np.fft.rfft(values)) ** 2
    assert values[0] == 0.0
    assert values[1000:].std() == pytest.approx(2e-3, rel=0.1)
    assert np.fft.rfftfreq(len(values), 0.01)[power.argmax()] == pytest.approx(1.5, rel=0.06)


def test_fixed_steps_give_what_the_accurate_integration_gives() -> None:
    robot = replace(paper_robot(), damping=np.full(3, 4e8))
    smooth = wander(robot, 3, 5.0)
    step = 0.02 / steps_for(robot, 0.02)
    times = np.arange(round(2 * 10.0 / step) + 1) * 0.5 * step
    speeds, travels = (np.array([way(t) for t in times]) for way in (smooth.speed, smooth.travel))
    effects = {"friction": {"coefficient": 0.02}}
    rig = Rig(robot, effects, TabulatedProgram(0.5 * step, speeds, travels))
    cells, places, _ = march(rig, step, round(10.0 / step))
    exact = simulate(robot, effects, smooth, [0.0, 5.0, 10.0])
    middle = len(places) // 2
    assert places[[0, middle, -1]] == pytest.approx(exact.position, abs=2e-6)
    assert cells[[0, middle, -1]] == pytest.approx(exact.cell, abs=0.02)


@pytest.mark.validate
@pytest.mark.parametrize("cables", [2, 3, 4])
def test_a_planar_robot_moves_and_is_shaken_in_its_plane_alone(cables: int) -> None:
    made = design(chance(cables), cables, True)
    assert made.robot.count == cables
    times = np.linspace(0.0, 20.0, 50)
    path = np.array([made.program(5).path(time)[0] for time in times])
    assert np.ptp(path[:, 1]) < 1e-9 * made.width
    assert np.ptp(path[:, 0]) > 0.02 * made.width
    true = true_robot(chance(), made, survey_of(chance(), made)).robot
    assert np.array_equal(true.anchors[:, 1], made.robot.anchors[:, 1])
    rig = Rig(true, {}, StillProgram(cables))
    assert np.abs(rig.evaluate(0.0, rig.begin()).acceleration).max() < 1e-9


@pytest.mark.validate
def test_designs_are_of_all_sizes_and_numbers_of_cables() -> None:
    made = [design(chance(seed)) for seed in range(40)]
    assert {one.robot.count for one in made} == set(LEVELS)
    assert {one.planar for one in made} == {True, False}
    assert min(one.width for one in made) < 2.0
    assert max(one.width for one in made) > 50.0
    for one in made:
        assert natural_frequencies(one.robot).max() < HIGHEST_MODE
        assert one.tension.min() > 0.0


def test_the_true_robot_lies_within_what_the_file_says() -> None:
    made = design(chance(4), 4, False)
    survey = survey_of(chance(5), made)
    content = tomllib.loads(robot_file(made, survey, "made"))
    drawn = [true_robot(chance(seed), made, survey) for seed in range(300)]
    moved = np.array(
        [(one.robot.anchors - made.robot.anchors) / content["cable"][0]["anchor_uncertainty"] for one in drawn]
    )
    assert np.abs(moved).max() <= FURTHEST + 1e-9
    assert moved.std() == pytest.approx(0.95, abs=0.05)
    heavier = np.array([one.robot.mass - made.robot.mass for one in drawn]) / content["platform"]["mass_uncertainty"]
    assert 0.8 < heavier.std() < 1.05
    zeros = np.array([one.offset for one in drawn]) / content["sensors"]["tension_offset_uncertainty"]
    gains = np.array([one.gain - 1.0 for one in drawn]) / content["sensors"]["tension_gain_uncertainty"]
    assert zeros.std() == pytest.approx(0.95, abs=0.05)
    assert gains.std() == pytest.approx(0.95, abs=0.08)


def test_noise_is_white_and_remembers() -> None:
    values = noisy(chance(), np.zeros((50_000, 3)), 0.01, 2.0, Memory(1.0, 0.3))
    assert values.std() == pytest.approx(np.sqrt(5.0), rel=0.05)
    assert np.diff(values, axis=0).std() == pytest.approx(2.0 * np.sqrt(2.0), rel=0.03)
    assert np.mean(values[:-5] * values[5:]) == pytest.approx(np.exp(-2 * np.pi * 0.3 * 0.05), rel=0.2)


def test_a_tracker_drops_out_and_jumps_a_little() -> None:
    still = np.zeros((6000, 3))
    seen = tracked(chance(2), still, 0.01, Tracker(dropouts=10.0, jumps=6.0, jump=1e-3))
    lost = np.isnan(seen[:, 0])
    assert 0.005 < lost.mean() < 0.2
    assert not lost[:100].any()
    assert 0.0 < np.nanmax(np.abs(seen)) <= 2e-3
    assert np.array_equal(tracked(chance(2), still, 0.01, Tracker()), still)


def test_counts_lose_no_rope_and_make_speeds_rough() -> None:
    travel = np.sin(np.linspace(0.0, 12.0, 4000))[:, None]
    told = counted(travel, 1e-3)
    speed = differentiated(told, 0.01)
    assert np.abs(told - travel).max() <= 0.5e-3 + 1e-12
    true = differentiated(travel, 0.01)
    assert np.std(speed - true) == pytest.approx(0.2 * 1e-3 / 0.01, rel=0.2)
    gained = np.sum(0.5 * (speed[1:] + speed[:-1]), axis=0) * 0.01
    assert gained == pytest.approx(told[-1] - told[0], abs=1.1e-3)


def test_a_backlash_holds_the_drum_until_the_gap_is_used_up() -> None:
    motor = np.array([[0.0], [0.3], [1.0], [0.8], [-0.5]])
    assert played(motor, 1.0)[:, 0] == pytest.approx([0.0, 0.0, 0.5, 0.5, 0.0])


def test_a_drift_begins_at_zero_and_ends_within_its_bound() -> None:
    values = drifting(chance(), (500, 40), 0.2)
    assert np.array_equal(values[0], np.zeros(40))
    assert 0.1 < np.abs(values).max() <= 0.2


def test_a_belt_gives_way_by_tension_over_stiffness() -> None:
    belt = Belt(stiffness_constant=1e5)
    rig = Rig(paper_robot(), {}, StillProgram(3), [belt])
    state = rig.begin()
    state[2] = -0.01
    taut = rig.evaluate(0.0, state)
    assert taut.speed == pytest.approx(-(taut.tension - rig.start_tension) / 1e5 / belt.time)
    assert taut.speed.max() < 0.0
    state[belt.part] = (taut.tension - rig.start_tension) / 1e5
    assert rig.evaluate(0.0, state).speed == pytest.approx(0.0, abs=1e-12)


def test_everything_hidden_is_an_effect_of_the_rig_with_a_form_of_its_own() -> None:
    lot = lot_of(1)
    assert {part.name for part in HIDDEN.values()} <= set(EFFECTS)
    assert {name for pair in PAIRS for name in pair} <= set(HIDDEN)
    listed = {part.name for part in HIDDEN.values() if part.manner == "right"}
    of_points = {name for name in EFFECTS if not (name.startswith("unlisted_") or EFFECTS[name].of_bodies)}
    assert listed == of_points - {"transverse_damping"}
    seen: list[str] = []
    for part in HIDDEN.values():
        assert part.least < part.most
        values = part.settings(part.least, Site(lot.design, lot.survey, 2, 1.0, 40.0, chance()))
        EFFECTS[part.name](**values)
        seen.append(json.dumps([part.name, values]))
    assert len(set(seen)) == len(HIDDEN)


def test_every_effect_with_a_form_is_hidden_in_a_wrong_one_too() -> None:
    constants = {"modulus", "anchor", "payload", "sensor_offset"}
    wrong = {part.name for part in HIDDEN.values() if part.manner == "wrong"}
    assert wrong == {part.name for part in HIDDEN.values() if part.manner == "right"} - constants


def test_little_things_are_as_small_as_noise_and_named() -> None:
    for seed in range(20):
        lot = lot_of(seed)
        noise = lot.design.robot.noise
        assert lot.little.cell.rms <= noise.tension
        assert lot.little.force_rms < 2e-3 * lot.design.weight
        assert set(lot.little.names) <= {name for names in CALLED.values() for name in names}
        assert set(lot.little.settings) <= set(CALLED)


@pytest.mark.validate
def test_the_hidden_thing_shows_clearly_beside_the_little_ones(short: Case) -> None:
    hidden, little = short.truth["size_of_hidden_rms"], short.truth["size_of_little_rms"]
    for role in ("fit", "check"):
        assert max(h / s for h, s in zip(hidden[role], little[role], strict=True)) > LEAST_RATIO
    assert short.truth["accept"] == ["friction"]
    assert "friction" not in short.truth["minor"]


@pytest.mark.validate
def test_the_truth_is_what_the_recordings_differ_by(short: Case) -> None:
    empty = lifelike(3, cables=3, planar=False, duration=6.0, rate=50.0)
    assert "friction" not in empty.truth["minor"]
    for role in ("fit", "check"):
        apart = short.recordings[role] - empty.recordings[role]
        tension = apart.filter(like="tension").to_numpy() / short.truth["robot"]["gain"]
        place, cell = short.truth["size_of_hidden_rms"][role]
        assert np.sqrt(np.mean(tension**2)) == pytest.approx(cell, rel=1e-6)
        assert np.sqrt(np.nanmean(apart[["x", "y", "z"]].to_numpy() ** 2)) == pytest.approx(place, abs=1e-9)


@pytest.mark.validate
def test_a_seed_gives_the_same_files_again_and_another_gives_others(tmp_path: Path) -> None:
    cases = [lifelike(seed, duration=4.0, rate=50.0, cables=3, planar=False) for seed in (7, 7, 8)]
    for index, case in enumerate(cases):
        case.write(tmp_path / str(index))
    texts = [{path.name: path.read_bytes() for path in sorted((tmp_path / str(index)).iterdir())} for index in range(3)]
    assert list(texts[0]) == ["check.csv", "fit.csv", "robot.toml", "truth.json"]
    assert texts[0] == texts[1]
    assert all(texts[0][name] != texts[2][name] for name in texts[0])
    truth = json.loads(texts[0]["truth.json"])
    assert truth["accept"] == ["none"]
    assert truth["size_of_hidden_rms"] == {"fit": [0.0, 0.0], "check": [0.0, 0.0]}
    frame = pd.read_csv(tmp_path / "0" / "fit.csv")
    assert len(frame) == 201
    assert not frame.equals(pd.read_csv(tmp_path / "0" / "check.csv"))


def test_a_log_has_the_gains_zeros_and_noise_of_its_robot() -> None:
    quiet = Memory(0.0, 1.0)
    lot = lot_of(2, cell=quiet, place=quiet, cell_drift=0.0, tracker=Tracker(), counts=0.0, lengths="speeds")
    session = Session(lot, 5, 8.0, 50.0)
    perfect = session.outputs({})
    log = session.log(perfect)
    noise = lot.design.robot.noise
    tension = log.filter(like="tension").to_numpy() - perfect.tension * lot.truth.gain
    assert tension.mean(axis=0) == pytest.approx(lot.truth.offset, abs=0.3 * noise.tension)
    assert tension.std() == pytest.approx(np.hypot(noise.tension, lot.truth.offset.std()), rel=0.1)
    place = log[["x", "y", "z"]].to_numpy() - perfect.position - lot.truth.position
    assert place.std() == pytest.approx(noise.position, rel=0.1)
    speed = log.filter(like="winch").to_numpy() - session.motor.speeds[:: 2 * session.substeps]
    assert speed.std() == pytest.approx(noise.winch_speed, rel=0.1)


def test_a_log_by_counts_may_have_lengths_that_shrink_as_rope_reels_in() -> None:
    lot = lot_of(2, counts=1e-5, lengths="lengths")
    session = Session(lot, 5, 4.0, 50.0)
    log = session.log(session.outputs({}))
    lengths = log.filter(like="rope_length").to_numpy()
    assert not [name for name in log.columns if name.startswith("winch")]
    reeled = session.motor.travels[:: 2 * session.substeps]
    assert lengths[0] - lengths == pytest.approx(reeled, abs=1.1e-5)


def test_a_design_says_what_it_carries() -> None:
    made: Design = design(chance(3), 3, False)
    direction = made.robot.anchors - made.robot.start
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    assert made.tension @ direction == pytest.approx([0.0, 0.0, made.weight], abs=1e-9 * made.weight)


def test_drums_behind_a_backlash_do_not_stop_where_the_recording_does() -> None:
    session = Session(lot_of(1, backlash=1e-6), 1, 4.0, 100.0)
    ends = session.drum.speeds[-1], session.motor.speeds[-1]
    assert np.abs(ends[1]).max() > 0.02
    assert ends[0] == pytest.approx(ends[1], abs=0.05 * np.abs(ends[1]).max())
