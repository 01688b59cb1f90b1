"""Units, signs and order of load cells that are not as declared are told by the balance of forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.recordings.alternative_readings import WindingReading
from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.geometry_reading import GeometryReading
from tautwire.recordings.mistaken_robot import robot_file_mistakes
from tautwire.recordings.mistaken_tensions import TensionCheck, _likely_orders, check_tensions
from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.weight_balance import ForceBalance, force_balance
from tautwire.robot.schema import Robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.pose_recordings import noisy, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot, octahedral_robot
from tests.support.robots import EXAMPLES, example
from tests.support.told_columns import assert_mended_by_told_lines, told_columns

Array = NDArray[np.float64]
NAMES = ["three", "caroca", "eight"]


def shipped(name: str) -> tuple[Robot, Recording]:
    robot = example(name).as_modelled()
    return robot, read_recording(EXAMPLES / name / "check.csv", robot.cable_count)


def tensions(recording: Recording, factor: Any) -> Recording:
    return replace(recording, tension=recording.tension * factor)


def stretched_robot() -> Robot:
    """A platform whose ropes pull from above and below, by 25 times its weight together."""
    crane = crane_robot()
    inertia = tuple(tuple(moment / 5.0 for moment in row) for row in crane.platform.inertia or ())
    cables = [
        replace(cable, anchor=(*cable.anchor[:2], -2.4)) if number in (1, 2, 5, 6) else cable
        for number, cable in enumerate(crane.cables, 1)
    ]
    platform = replace(crane.platform, mass=crane.platform.mass / 5.0, inertia=inertia)
    return replace(crane, cables=tuple(cables), platform=platform)


def stretched_recording() -> Recording:
    return noisy(wandering_recording(stretched_robot(), travel=0.2, angle=0.05))


def checked(robot: Robot, recording: Recording) -> TensionCheck | None:
    return check_tensions(robot, recording, GeometryReading(), WindingReading())


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("factor", "cause", "remedy"),
    [
        (1e-3, "are in kN, or the robot file's platform.mass is 1000 times the true one", " by 1000"),
        (1e3, "are in mN", " by 0.001"),
        (1.0 / 9.80665, "are in kg", '"tension_{}" = { unit = "kg" }, which is to multiply tension_1'),
        (1e3 / 9.80665, "are in g", " by 0.009807"),
        (1.0 / 4.4482216, "are in lbf", " by 4.448"),
        (-1.0, "have the other sign", "multiply by -1"),
    ],
)
def test_a_unit_or_a_sign_is_told_with_its_remedy(name: str, factor: float, cause: str, remedy: str) -> None:
    robot, recording = shipped(name)
    (error,) = recording_mistakes(robot, tensions(recording, factor))
    assert f"if tension_1 to tension_{robot.cable_count} {cause}" in error.problem and remedy in error.hint
    assert "tensions do not match the platform's weight" in error.problem


@pytest.mark.parametrize("name", NAMES)
def test_swapped_load_cells_are_told(name: str) -> None:
    robot, recording = shipped(name)
    order = [1, 0, *range(2, robot.cable_count)]
    (error,) = recording_mistakes(robot, replace(recording, tension=recording.tension[:, order]))
    assert f"load cells of cables 1 to {robot.cable_count} are tension_2, tension_1, tension_3" in error.problem


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("factor", "cause", "remedy"),
    [
        (1e-3, "if tension_2 alone is in kN", 'tension_2 = { unit = "kN" }, which is to multiply it by 1000'),
        (-1.0, "if tension_2 alone has the other sign", "tension_2 = { sign = -1 }"),
    ],
)
def test_one_load_cell_in_another_unit_or_of_the_other_sign_is_told(
    name: str, factor: float, cause: str, remedy: str
) -> None:
    robot, recording = shipped(name)
    factors = np.where(np.arange(robot.cable_count) == 1, factor, 1.0)
    (error,) = recording_mistakes(robot, tensions(recording, factors))
    assert cause in error.problem and remedy in error.hint


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("newtons", [0.15, 2500.0])
def test_numbers_of_an_amplifier_are_told_with_their_factor(name: str, newtons: float) -> None:
    robot, recording = shipped(name)
    (error,) = recording_mistakes(robot, tensions(recording, 1.0 / newtons))
    told = float(error.problem.split(" is about ")[1].split(" N")[0])
    assert told == pytest.approx(newtons, rel=0.1) and "declare factor, and offset" in error.hint


@pytest.mark.parametrize("name", NAMES)
def test_load_cells_that_were_tared_under_load_are_told_with_the_tensions_of_statics(name: str) -> None:
    robot, recording = shipped(name)
    tared = replace(recording, tension=recording.tension - recording.tension[:10].mean(axis=0))
    (error,) = recording_mistakes(robot, tared)
    assert "were tared at the start" in error.problem
    columns = told_columns(error.hint)
    offsets = [columns[f"tension_{cable}"]["offset"] for cable in robot.cable_numbers]
    assert offsets == pytest.approx(-static_tensions(robot), rel=1e-3)


MISTAKES: dict[str, Callable[[Array], Array]] = {
    "kN": lambda tension: 1e-3 * tension,
    "other sign": lambda tension: -tension,
    "other order": lambda tension: tension[:, ::-1],
    "one in kN of the other sign": lambda tension: tension * np.where(np.arange(tension.shape[1]) == 1, -1e-3, 1.0),
    "tared": lambda tension: tension - tension[:10].mean(axis=0),
    "tared, of the other sign": lambda tension: tension[:10].mean(axis=0) - tension,
    "tared, in kN": lambda tension: 1e-3 * (tension - tension[:10].mean(axis=0)),
    "tared, in volts": lambda tension: (tension - tension[:10].mean(axis=0)) / 317.0,
    "4 to 20 mA": lambda tension: 4.0 + 16.0 * tension / 9000.0,
    "no cell at the last cable, and mN": lambda tension: (
        1e3 * np.where(np.arange(tension.shape[1]) < tension.shape[1] - 1, tension, np.nan)
    ),
}


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_told_lines_mend_the_load_cells(tmp_path: Path, name: str, mistake: str) -> None:
    robot, recording = shipped(name)
    assert_mended_by_told_lines(robot, replace(recording, tension=MISTAKES[mistake](recording.tension)), tmp_path)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("taring", "cause"),
    [(-1.0, ", and have the other sign"), (1e-3, ", and are in kN"), (1.0 / 317.0, ", and 1 of theirs is about 3")],
)
def test_tared_load_cells_are_told_with_their_unit_and_sign(name: str, taring: float, cause: str) -> None:
    robot, recording = shipped(name)
    shown = taring * (recording.tension - recording.tension[:10].mean(axis=0))
    (error,) = recording_mistakes(robot, replace(recording, tension=shown))
    assert "were tared at the start, where statics gives" in error.problem and f" N{cause}" in error.problem


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("zero", "span"), [(4.0, 16.0), (0.5, 4.0), (32768.0, 32767.0)])
def test_what_load_cells_show_without_load_is_told_with_their_factor(name: str, zero: float, span: float) -> None:
    robot, recording = shipped(name)
    newtons = 8.0 * float(recording.tension.mean())
    shown = zero + span * recording.tension / newtons
    (error,) = recording_mistakes(robot, replace(recording, tension=shown))
    (column,) = told_columns(error.hint).values()
    assert column["factor"] == pytest.approx(newtons / span, rel=0.08)
    assert column["offset"] == pytest.approx(zero, abs=0.03 * span)


@pytest.mark.parametrize(
    "effects",
    [
        {"sensor_gain": {"gain": 1.3, "outputs": "tension", "cables": [2]}},
        {"payload": {"mass": 90.0}},
        {"sensor_offset": {"force": 400.0}},
    ],
    ids=str,
)
def test_effects_are_not_taken_for_odd_load_cells(effects: dict[str, Any]) -> None:
    robot = example("three").as_modelled()
    assert recording_mistakes(robot, recorded("three", 3, effects)) == ()


def test_one_load_cell_that_was_tared_under_load_is_told_alone() -> None:
    robot, recording = shipped("three")
    tension = recording.tension.copy()
    tension[:, 1] -= tension[:10, 1].mean()
    (error,) = recording_mistakes(robot, replace(recording, tension=tension))
    assert "if tension_2 was tared at the start, where statics gives" in error.problem
    (offset,) = (column["offset"] for column in told_columns(error.hint).values())
    assert -offset == pytest.approx(static_tensions(robot)[1], rel=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_numbers_that_are_no_tensions_are_refused_and_no_ropes_blamed(name: str) -> None:
    robot, recording = shipped(name)
    volts = 0.5 + np.linspace(1.2, 2.2, robot.cable_count) * recording.tension / recording.tension.mean(axis=0)
    shown = replace(recording, tension=volts)
    (error,) = recording_mistakes(robot, shown)
    assert "tensions do not match the platform's weight: they carry" in error.problem
    assert tuple(robot_file_mistakes(robot, shown, "robot.toml")) == ()


def test_load_cells_with_zeros_of_their_own_are_left_to_the_trace() -> None:
    """As large as one and a half times their tensions."""
    robot, recording = shipped("three")
    random = np.random.default_rng(1)
    for _ in range(12):
        zeros = 1.5 * recording.tension.mean() * random.standard_normal(3)
        assert recording_mistakes(robot, replace(recording, tension=recording.tension + zeros)) == ()


def test_gains_where_ropes_pull_far_more_than_the_weight_are_left_to_the_trace() -> None:
    robot = stretched_robot()
    for below in (1.1, 1.2):
        gains = np.where(np.array(robot.anchors)[:, 2] > robot.platform.start[2], 0.9, below)
        check = checked(robot, tensions(stretched_recording(), gains))
        assert check is not None and check.carried < 0.0 and check.mistakes == () and not check.is_hopeless


def test_a_mass_in_pounds_is_told() -> None:
    robot, recording = shipped("three")
    platform = replace(robot.platform, mass=robot.platform.mass / 0.45359237)
    (error,) = recording_mistakes(replace(robot, platform=platform), recording)
    assert "if the robot file's platform.mass is in lb" in error.problem
    assert "multiply it by 0.4536" in error.hint
    for factor in (0.6, 1.6, 2.0):
        other = replace(robot.platform, mass=robot.platform.mass * factor)
        assert recording_mistakes(replace(robot, platform=other), recording) == ()


def test_cells_that_show_nothing_at_the_start_are_not_taken_for_tared_ones(recwarn: pytest.WarningsRecorder) -> None:
    robot, recording = shipped("three")
    halved = np.where(recording.time[:, None] > recording.time[0] + 1.0, 0.5 * recording.tension, np.nan)
    assert recording_mistakes(robot, replace(recording, tension=halved)) == ()
    assert not recwarn.list


@pytest.mark.parametrize(
    "order", [[2, 0, 1, 3, 4, 5, 6, 7], [1, 0, 3, 2, 4, 5, 7, 6], [3, 6, 0, 5, 1, 7, 2, 4]], ids=str
)
def test_any_order_of_eight_load_cells_is_told(order: list[int]) -> None:
    robot, recording = shipped("eight")
    (error,) = recording_mistakes(robot, replace(recording, tension=recording.tension[:, order]))
    cells = ", ".join(f"tension_{order.index(cable) + 1}" for cable in range(8))
    assert f"load cells of cables 1 to 8 are {cells}" in error.problem


def test_swapped_load_cells_are_told_beside_gains_that_err_by_some_per_cent() -> None:
    robot = crane_robot()
    recording = noisy(wandering_recording(robot))
    gains = 1.0 + 0.018 * np.array([1, -1, -1, 1, 1, -1, 1, -1])
    erring = tensions(recording, gains)
    check = checked(robot, erring)
    assert check is not None and 0.015 < check.misfit < 0.03 and check.mistakes == ()
    swapped = replace(erring, tension=erring.tension[:, [0, 2, 1, *range(3, 8)]])
    (error,) = recording_mistakes(robot, swapped)
    assert "are tension_1, tension_3, tension_2, tension_4" in error.problem


def test_swapped_load_cells_are_told_where_ropes_pull_far_more_than_the_weight() -> None:
    robot = stretched_robot()
    erring = tensions(stretched_recording(), 1.0 + 0.01 * np.array([1, -1, -1, 1, 1, -1, 1, -1]))
    check = checked(robot, erring)
    assert check is not None and check.misfit > 0.05 and check.mistakes == ()
    (error,) = recording_mistakes(robot, replace(erring, tension=erring.tension[:, [0, 2, 1, *range(3, 8)]]))
    assert "are tension_1, tension_3, tension_2, tension_4" in error.problem


def planar_balance(random: np.random.Generator, gain_error: float) -> ForceBalance:
    """Four ropes in a plane that pull four times the weight of 10 N, on a motion of a few centimetres."""
    anchors = np.array([[1.5, 0.0, 0.0], [1.5, 0.0, 2.3], [-1.5, 0.0, 2.3], [-1.5, 0.0, 0.0]])
    moved = np.array([0.05, 0.0, 0.05]) * random.uniform(-1.0, 1.0, (80, 3))
    ropes = anchors - (np.array([0.1, 0.0, 1.2]) + moved)[:, None]
    directions = (ropes / np.linalg.norm(ropes, axis=2, keepdims=True)).transpose(0, 2, 1)
    weight = np.tile([0.0, 0.0, 10.0], (80, 1))
    missing = weight - 20.0 * directions.sum(axis=2)
    tensions = 20.0 + np.einsum("bic,bc->bi", np.linalg.pinv(directions), missing)
    gains = 1.0 + gain_error * random.uniform(-1.0, 1.0, 4)
    return ForceBalance(0.25 * np.arange(80), directions, gains * tensions, weight, (True,) * 4)


def test_gains_of_single_load_cells_are_no_other_order_and_swapped_cells_are_no_gains() -> None:
    """Of gains that are off by 5 % one in a hundred still looks like another order."""
    random = np.random.default_rng(1)
    orders = [_likely_orders(planar_balance(random, 0.05))[0] for _ in range(300)]
    assert sum(order != (0, 1, 2, 3) for order in orders) <= 4
    for _ in range(20):
        balance = planar_balance(random, 0.01)
        swapped = replace(balance, tensions=balance.tensions[:, [1, 0, 2, 3]])
        assert _likely_orders(swapped) == [(1, 0, 2, 3)]


def test_load_cells_in_a_circle_are_told() -> None:
    robot, recording = shipped("caroca")
    (error,) = recording_mistakes(robot, replace(recording, tension=recording.tension[:, [1, 2, 0]]))
    assert "are tension_3, tension_1, tension_2" in error.problem


def test_a_unit_and_an_order_are_told_together() -> None:
    robot, recording = shipped("caroca")
    (error,) = recording_mistakes(robot, replace(recording, tension=1e-3 * recording.tension[:, [1, 0, 2]]))
    assert "are in kN" in error.problem and "are tension_2, tension_1, tension_3" in error.problem


@pytest.mark.parametrize("name", NAMES)
def test_a_cable_without_load_cell_hides_no_unit(name: str) -> None:
    robot, recording = shipped(name)
    cells = np.array([np.nan, *[1e-3] * (robot.cable_count - 1)])
    (error,) = recording_mistakes(robot, tensions(recording, cells))
    assert "are in kN" in error.problem


@pytest.mark.parametrize("name", NAMES)
def test_without_positions_the_start_serves(name: str) -> None:
    robot, recording = shipped(name)
    recording = replace(recording, position=np.full_like(recording.position, np.nan))
    assert recording_mistakes(robot, recording) == ()
    (error,) = recording_mistakes(robot, tensions(recording, 1e-3))
    assert "are in kN" in error.problem


def test_mistakes_of_motion_and_of_tensions_are_told_both() -> None:
    robot, recording = shipped("three")
    recording = replace(tensions(recording, 1e-3), time=1e3 * recording.time, position=1e3 * recording.position)
    motion, forces = recording_mistakes(robot, recording)
    assert "x, y, z are in mm and time is in ms" in motion.problem and "are in kN" in forces.problem


@pytest.mark.parametrize("name", NAMES)
def test_the_balance_holds_on_correct_recordings(name: str) -> None:
    robot, recording = shipped(name)
    check = checked(robot, recording)
    assert check is not None and check.mistakes == ()
    assert check.carried == pytest.approx(1.0, abs=0.08) and check.misfit < 0.08


def test_inertia_is_part_of_the_balance() -> None:
    """A platform that falls with half of gravity is carried by half of its weight."""
    robot = replace(example("three").as_modelled(), effects=())
    time = np.arange(301) / 100.0
    start = np.array(robot.platform.start)
    position = start + np.outer(-0.25 * robot.gravity * time**2, [0.0, 0.0, 1.0]) * 0.1
    vectors = np.array(robot.anchors) - position[:, None]
    directions = vectors / np.linalg.norm(vectors, axis=2)[..., None]
    weight = robot.platform.mass * robot.gravity * (1.0 - 0.05) * np.array([0.0, 0.0, 1.0])
    tension = np.linalg.solve(directions.transpose(0, 2, 1), np.tile(weight, (len(time), 1))[..., None])[..., 0]
    lengths = np.linalg.norm(vectors, axis=2)
    recording = Recording("fall.csv", time, -np.gradient(lengths, time, axis=0), tension, position)
    check = checked(robot, recording)
    assert check is not None and check.misfit < 2e-3


@pytest.mark.parametrize(
    "effects",
    [
        {"payload": {"mass": 70.0}},
        {"sensor_gain": {"gain": 1.15, "cables": [2]}},
        {"sensor_offset": {"force": 200.0, "cables": [1]}},
        {"drag": {"drag_area": 30.0, "wind": [5.0, 0.0, 0.0]}},
    ],
    ids=str,
)
def test_effects_are_not_taken_for_mistakes(effects: dict[str, Any]) -> None:
    robot = example("three").as_modelled()
    assert recording_mistakes(robot, recorded("three", 3, effects)) == ()


def balanced(robot: Robot, offset: np.ndarray, internal: float = 0.0) -> Recording:
    """A slow motion with the tensions that carry the weight, and an internal tension where cables are redundant."""
    position = np.array(robot.platform.start) + offset
    vectors = np.array(robot.anchors) - position[:, None]
    directions = (vectors / np.linalg.norm(vectors, axis=2)[..., None]).transpose(0, 2, 1)
    inverse = np.linalg.pinv(directions)
    weight = np.array([0.0, 0.0, robot.platform.mass * robot.gravity])
    count = robot.cable_count
    tension = inverse @ weight + (np.eye(count) - inverse @ directions) @ np.full(count, internal)
    time = np.arange(len(offset)) / 100.0
    return Recording("log.csv", time, np.zeros((len(offset), count)), tension, position)


@pytest.mark.validate
@pytest.mark.parametrize("reach", [0.0, 0.1])
def test_gains_of_a_few_per_cent_are_no_swapped_cells(reach: float) -> None:
    robot = example("eight").as_modelled()
    time = np.arange(2001) / 100.0
    offset = reach * np.column_stack((np.sin(time), np.cos(1.3 * time), np.sin(0.7 * time)))
    recording = balanced(robot, offset, internal=robot.platform.mass * robot.gravity)
    for seed in range(40):
        generator = np.random.default_rng(seed)
        gains = 1.0 + 0.03 * generator.normal(size=robot.cable_count)
        check = checked(robot, tensions(recording, gains))
        assert check is not None and check.mistakes == ()


@pytest.mark.parametrize("ratio", [0.3, 2.0, 3.0, 4.0, 6.0, 8.0])
def test_another_payload_is_no_unit(ratio: float) -> None:
    robot, recording = shipped("three")
    assert recording_mistakes(robot, tensions(recording, 1.0 / ratio)) == ()


def test_load_cells_that_were_tared_at_the_standstill_are_no_unit() -> None:
    robot = example("three").as_modelled()
    recording = balanced(robot, np.zeros((2001, 3)))
    noise = np.random.default_rng(1).normal(size=recording.tension.shape)
    assert recording_mistakes(robot, replace(recording, tension=1.6 + noise)) == ()


def test_nothing_is_said_without_gravity() -> None:
    robot, recording = shipped("three")
    assert checked(replace(robot, gravity=0.0), recording) is None


def test_a_tracker_that_is_slower_than_the_load_cells_serves() -> None:
    robot, recording = shipped("three")
    position = np.full_like(recording.position, np.nan)
    position[::10] = recording.position[::10]
    check = checked(robot, replace(tensions(recording, 1e-3), position=position))
    assert check is not None and any("are in kN" in mistake.cause for (mistake,) in check.mistakes)


@pytest.mark.parametrize("name", NAMES)
def test_a_unit_of_load_cells_slower_than_the_blocks_is_told(name: str) -> None:
    robot, recording = shipped(name)
    is_sample = np.arange(recording.sample_count)[:, None] % 50 == 0
    slow = replace(recording, tension=np.where(is_sample, recording.tension, np.nan))
    assert not recording_mistakes(robot, slow)
    (error,) = recording_mistakes(robot, tensions(slow, 1e-3))
    assert "are in kN" in error.problem


def test_blocks_that_span_a_gap_do_not_count() -> None:
    robot, recording = shipped("three")
    time = recording.time + 30.0 * (recording.time > recording.time[recording.sample_count // 2])
    check = checked(robot, replace(recording, time=time))
    assert check is not None and check.misfit < 0.01


def test_nothing_is_said_of_a_platform_outside_of_its_robot() -> None:
    robot, recording = shipped("three")
    noise = 1e-3 * np.random.default_rng(1).standard_normal(recording.position.shape)
    assert recording_mistakes(robot, replace(recording, position=noise + np.array([29.0, 0.0, 1e3]))) == ()


def test_nothing_is_said_of_too_little() -> None:
    robot, recording = shipped("three")
    assert checked(robot, tensions(recording, np.nan)) is None
    assert checked(robot, recording.first(20)) is None


def test_noise_is_not_taken_for_a_unit() -> None:
    robot, recording = shipped("three")
    noise = np.random.default_rng(2).normal(size=recording.tension.shape)
    assert checked(robot, replace(recording, tension=noise)) is None


@pytest.mark.parametrize("rows_per_sample", [3, 4])
def test_forces_balance_beside_a_tracker_slower_than_the_log(rows_per_sample: int) -> None:
    robot, recording = shipped("three")
    is_missing = np.arange(recording.sample_count)[:, None] % rows_per_sample > 0
    slow = replace(recording, position=np.where(is_missing, np.nan, recording.position))
    fast, balance = (force_balance(robot, each, GeometryReading(), WindingReading()) for each in (recording, slow))
    assert fast is not None and balance is not None
    assert balance.misfit((0, 1, 2)) < 1.5 * fast.misfit((0, 1, 2)) < 0.01


CRANE = crane_robot()


@pytest.mark.parametrize("robot", [CRANE, octahedral_robot()], ids=lambda robot: robot.name)
def test_forces_and_moments_on_a_rigid_platform_balance(robot: Robot) -> None:
    recording = noisy(wandering_recording(robot))
    check = checked(robot, recording)
    assert check is not None and check.mistakes == ()
    assert check.carried == pytest.approx(1.0, abs=1e-3) and check.misfit < 4e-3
    balance = force_balance(robot, recording, GeometryReading(), WindingReading())
    assert balance is not None and balance.directions.shape[1:] == (6, robot.cable_count)
    assert balance.balanced_tensions() == pytest.approx(balance.tensions, abs=6.0)


@pytest.mark.parametrize(
    ("factor", "cause"), [(1e-3, "are in kN"), (1.0 / 9.80665, "are in kg"), (-1.0, "have the other sign")]
)
def test_a_unit_or_a_sign_of_a_rigid_platforms_load_cells_is_told(factor: float, cause: str) -> None:
    (error,) = recording_mistakes(CRANE, tensions(noisy(wandering_recording(CRANE)), factor))
    assert f"if tension_1 to tension_8 {cause}" in error.problem


@pytest.mark.parametrize("angle", [0.2, 0.0])
def test_moments_tell_swapped_load_cells(angle: float) -> None:
    recording = noisy(wandering_recording(CRANE, travel=0.5, angle=angle))
    swapped = replace(recording, tension=recording.tension[:, [0, 1, 3, 2, 4, 5, 6, 7]])
    (error,) = recording_mistakes(CRANE, swapped)
    assert "cables 1 to 8 are tension_1, tension_2, tension_4, tension_3, tension_5" in error.problem


def test_a_cable_without_load_cell_may_exert_any_moment() -> None:
    recording = noisy(wandering_recording(CRANE))
    tension = recording.tension.copy()
    tension[:, 4] = np.nan
    check = checked(CRANE, replace(recording, tension=tension))
    assert check is not None and check.mistakes == () and check.misfit < 4e-3


def test_without_orientation_forces_alone_tell_a_unit() -> None:
    recording = noisy(wandering_recording(CRANE))
    unturned = replace(recording, orientation=np.full((recording.sample_count, 4), np.nan))
    balance = force_balance(CRANE, unturned, GeometryReading(), WindingReading())
    assert balance is not None and balance.directions.shape[1:] == (3, 8)
    assert recording_mistakes(CRANE, unturned) == ()
    (error,) = recording_mistakes(CRANE, tensions(unturned, 1e-3))
    assert "are in kN" in error.problem
