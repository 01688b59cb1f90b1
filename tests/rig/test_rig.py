"""The test rig against closed forms, conservation laws and the paper's figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import simpson

from tests.rig import (
    PathProgram,
    RampProgram,
    Run,
    SampledProgram,
    StillProgram,
    TensionLimits,
    eight_robot,
    make_recording,
    paper_robot,
    simulate,
    symmetric_robot,
    wander,
    with_law,
    write_recording,
)
from tests.rig.statics import start_tensions
from tests.rig.wander import natural_frequencies

RAMP = RampProgram(np.array([0.3, 0.25, -0.25]), 1.0)


def energy(run: Run) -> np.ndarray:
    """Kinetic, potential and strain energy with still winches and the logarithmic law, J."""
    robot, start = run.rig.robot, run.rig.start_length
    axial = robot.modulus * robot.area
    stretch = run.length * np.log(run.length / start) - run.length + start
    ropes = (axial * stretch + run.rig.start_tension * (run.length - start)).sum(axis=1)
    kinetic = 0.5 * robot.mass * (run.velocity**2).sum(axis=1)
    return kinetic + robot.mass * robot.gravity * run.position[:, 2] + ropes


def oscillation_frequency(times: np.ndarray, values: np.ndarray) -> float:
    """From the first to the last rising zero crossing, Hz."""
    rising = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    step = times[1] - times[0]
    crossings = times[rising] - step * values[rising] / (values[rising + 1] - values[rising])
    return (len(crossings) - 1) / (crossings[-1] - crossings[0])


def test_resting_robot_stays_where_it_is() -> None:
    run = simulate(paper_robot(), {}, StillProgram(3), [0.0, 10.0])
    assert np.allclose(run.position[-1], [28.86, 0, 5], atol=1e-9)
    assert run.tension[-1] == pytest.approx(run.rig.start_tension, rel=1e-9)


def test_start_tensions_of_the_paper() -> None:
    run = simulate(paper_robot(), {}, StillProgram(3), [0.0])
    assert run.cell[0] == pytest.approx(1594.1, abs=0.3)


def test_start_tension_of_a_symmetric_robot_is_weight_over_three_sines() -> None:
    run = simulate(symmetric_robot(), {}, StillProgram(3), [0.0])
    assert run.cell[0] == pytest.approx(50.0 * 9.8 / (3 * 3.0 / 5.0))


def test_payload_raises_start_tension_in_proportion_and_leaves_the_start() -> None:
    run = simulate(symmetric_robot(), {"payload": {"mass": 10.0}}, StillProgram(3), [0.0, 5.0])
    assert run.cell == pytest.approx(60.0 * 9.8 / (3 * 3.0 / 5.0))
    assert np.allclose(run.position, 0.0, atol=1e-10)


def test_eight_start_tensions_are_in_equilibrium_within_limits_and_nearest_to_preferred() -> None:
    robot = eight_robot()
    span = robot.anchors - robot.start
    direction = span / np.linalg.norm(span, axis=1, keepdims=True)
    load = np.array([0.0, 0.0, -robot.mass * robot.gravity])
    limits = TensionLimits(minimum=400.0, maximum=760.0, preferred=600.0)
    tension = start_tensions(direction, load, limits)
    assert np.allclose(direction.T @ tension, -load, atol=1e-7)
    assert tension.min() >= 400.0
    assert tension.max() <= 760.0
    assert np.isclose(tension, 400.0).any(), "a limit should bind here"
    null = np.linalg.svd(direction.T)[2][3:]
    random = np.random.default_rng(1)
    for _ in range(500):
        other = tension + random.normal(size=5) @ null
        if other.min() >= 400.0 and other.max() <= 760.0:
            assert np.sum((other - 600) ** 2) >= np.sum((tension - 600) ** 2) - 1e-6


def test_start_where_a_cable_would_push_is_refused() -> None:
    outside = replace(paper_robot(), start=np.array([-30.0, 0.0, 5.0]))
    with pytest.raises(ValueError, match="a cable would have to push"):
        simulate(outside, {}, StillProgram(3), [0.0])


@pytest.mark.parametrize("axis", [0, 2])
def test_free_oscillation_has_the_frequency_of_the_eigenproblem(axis: int) -> None:
    robot = symmetric_robot()
    kick = np.zeros(3)
    kick[axis] = 1e-5
    times = np.arange(0, 10, 0.005)
    run = simulate(robot, {}, StillProgram(3), times, velocity=kick, atol=1e-16)
    axial, tension, length, cosine, sine = 1e9 * 1.25664e-5, 50 * 9.8 / 1.8, 5.0, 0.8, 0.6
    stiffness = {
        0: 1.5 * (axial * cosine**2 + tension * (1 + sine**2)) / length,
        2: 3.0 * (axial * sine**2 + tension * cosine**2) / length,
    }[axis]
    expected = np.sqrt(stiffness / 50.0) / (2 * np.pi)
    assert oscillation_frequency(times, run.position[:, axis]) == pytest.approx(expected, rel=1e-5)
    assert np.isclose(natural_frequencies(robot), expected, rtol=1e-9).any()


def test_damped_free_oscillation_decays_at_the_rate_of_the_law() -> None:
    damping = 2e7
    times = np.arange(0, 4, 0.002)
    robot = replace(symmetric_robot(), damping=np.full(3, damping))
    run = simulate(robot, {}, StillProgram(3), times, velocity=[0, 0, 1e-5], atol=1e-16)
    height = run.position[:, 2]
    peaks = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] > height[2:])) + 1
    decay = -np.polyfit(times[peaks], np.log(height[peaks]), 1)[0]
    assert decay == pytest.approx(3 * damping * 1.25664e-5 * 0.36 / 5.0 / (2 * 50.0), rel=2e-3)


def test_undamped_free_swing_keeps_its_energy() -> None:
    run = simulate(paper_robot(), {}, StillProgram(3), np.arange(0, 20, 0.1), velocity=[0.4, 0.3, -0.2])
    total = energy(run)
    assert np.abs(total - total[0]).max() < 1e-6 * 0.5 * 300 * 0.29
    assert np.ptp(run.position, axis=0).min() > 0.04


def test_damping_takes_energy_away() -> None:
    effects = {"damping": {"damping": 2e9}}
    run = simulate(paper_robot(), effects, StillProgram(3), np.arange(0, 20, 0.1), velocity=[0, 0, 0.5])
    total = energy(run)
    assert np.all(np.diff(total) < 1e-6)
    assert total[-1] == pytest.approx(300 * 9.8 * 5.0, abs=1e-4)


def test_momentum_gained_is_the_impulse_of_pulls_and_weight() -> None:
    times = np.linspace(0, 7, 7001)
    run = simulate(paper_robot(), {"damping": {"damping": 5e8}}, RAMP, times)
    force = np.einsum("ti,tij->tj", run.pull, run.direction) - np.array([0, 0, 300 * 9.8])
    impulse = simpson(force, x=times, axis=0)
    assert impulse == pytest.approx(300 * run.velocity[-1], abs=1e-4)


def test_linear_law_rests_where_statics_puts_the_reeled_rope() -> None:
    robot = replace(with_law(symmetric_robot(), "linear"), damping=np.full(3, 3e8))
    none = np.zeros((0, 3))
    program = PathProgram(robot.anchors, robot.start, np.array([0, 0, 0.5]), none, none[:, 0], none, 4.0)
    run = simulate(robot, {}, program, [0.0, 60.0])
    reeled = 5.0 - np.hypot(4.0, 2.5)
    length, tension = run.length[-1, 0], run.tension[-1, 0]
    height = 3.0 - run.position[-1, 2]
    assert length == pytest.approx(np.hypot(4.0, height), rel=1e-12)
    assert tension == pytest.approx(50 * 9.8 * length / (3 * height), rel=1e-7)
    started = 50 * 9.8 / 1.8
    assert tension == pytest.approx(1e9 * 1.25664e-5 * (length - 5.0 + reeled) / length + started, rel=1e-7)


def test_linear_and_logarithmic_law_agree_for_small_strain_and_still_winches() -> None:
    stiff = paper_robot(1e12)
    times = np.arange(0, 5, 0.05)
    kick = [0.0, 0.0, 1e-3]
    one = simulate(stiff, {}, StillProgram(3), times, velocity=kick)
    other = simulate(with_law(stiff, "linear"), {}, StillProgram(3), times, velocity=kick)
    assert np.abs(one.position - other.position).max() < 1e-4 * np.abs(one.position - stiff.start).max()


def test_laws_differ_by_millimetres_once_much_rope_is_wound() -> None:
    robot, times = paper_robot(), np.arange(0, 7.001, 0.05)
    gap = simulate(robot, {}, RAMP, times).position - simulate(with_law(robot, "linear"), {}, RAMP, times).position
    assert 5e-4 < np.abs(gap).max() < 1e-2


def test_integration_converges_on_itself() -> None:
    robot = paper_robot()
    program = wander(robot, 3, 5.0)
    times = np.arange(0, 10.01, 0.1)
    coarse = simulate(robot, {}, program, times)
    fine = simulate(robot, {}, program, times, rtol=1e-13, atol=1e-14)
    assert np.abs(coarse.position - fine.position).max() < 1e-8
    assert np.abs(coarse.cell - fine.cell).max() < 1e-3


@pytest.mark.validate
def test_two_integration_methods_agree() -> None:
    robot = replace(paper_robot(), damping=np.full(3, 4e8))
    one = simulate(robot, {}, RAMP, [0.0, 7.0])
    other = simulate(robot, {}, RAMP, [0.0, 7.0], method="Radau", rtol=1e-9)
    assert one.position[-1] == pytest.approx(other.position[-1], abs=1e-6)


def test_neutral_effects_change_nothing() -> None:
    robot = replace(paper_robot(), damping=np.full(3, 4e8))
    plain = simulate(robot, {}, RAMP, [0.0, 3.0, 7.0])
    neutral = {"damping": {"damping": 4e8}, "modulus": {"modulus": 1.348e11}, "payload": {"mass": 0.0}}
    same = simulate(robot, neutral, RAMP, [0.0, 3.0, 7.0])
    assert np.array_equal(plain.position, same.position)
    assert np.array_equal(plain.cell, same.cell)


def test_modulus_of_one_cable_leaves_the_others() -> None:
    run = simulate(paper_robot(), {"modulus": {"modulus": 9e10, "cables": [2]}}, StillProgram(3), [0.0])
    assert run.rig.robot.modulus == pytest.approx([1.348e11, 9e10, 1.348e11])


def test_travel_of_every_program_is_the_integral_of_its_speed() -> None:
    robot = paper_robot()
    times = np.linspace(0, 9, 3601)
    path = wander(robot, 5, 5.0)
    speeds = np.array([[0, 1, 0], [1, -1, 2], [2, 0, 1], [0, 0.5, -1]])
    sampled = SampledProgram(np.array([0.0, 2.0, 5.0, 9.0]), speeds)
    for program in (RAMP, path, sampled):
        speed = np.array([program.speed(time) for time in times])
        middle = np.array([program.speed(time) for time in 0.5 * (times[1:] + times[:-1])])
        integral = (speed[:-1] + 4 * middle + speed[1:]).sum(axis=0) * (times[1] - times[0]) / 6
        assert program.travel(9.0) == pytest.approx(integral, abs=1e-6)


@pytest.mark.validate
def test_wandering_program_starts_at_rest_and_keeps_ropes_tight() -> None:
    robot = replace(eight_robot(), damping=np.full(8, 3e8))
    program = wander(robot, 7, 1.0)
    run = simulate(robot, {}, program, np.arange(0, 8, 0.1))
    assert np.array_equal(program.speed(0.0), np.zeros(8))
    assert run.cell.min() > 100.0


def test_recording_has_the_columns_of_the_format_and_only_its_noise_depends_on_the_seed(
    tmp_path: Path,
) -> None:
    robot = paper_robot()
    noisy = replace(robot, noise=replace(robot.noise, position=1e-3, tension=2.0, winch_speed=1e-3))
    program = wander(robot, 3, 5.0)
    one = make_recording(noisy, {}, program, duration=4.0, rate=100.0, seed=1)
    two = make_recording(noisy, {}, program, duration=4.0, rate=100.0, seed=2)
    truth = make_recording(noisy, {}, program, duration=4.0, rate=100.0, seed=1, noise=False)
    winches = [f"winch_speed_{cable}" for cable in (1, 2, 3)]
    tensions = [f"tension_{cable}" for cable in (1, 2, 3)]
    assert list(one.columns) == ["time", *winches, *tensions, "x", "y", "z"]
    assert len(one) == 401
    for column, deviation in (("x", 1e-3), ("tension_2", 2.0), ("winch_speed_3", 1e-3)):
        assert np.std(one[column] - truth[column]) == pytest.approx(deviation, rel=0.15)
        assert not np.array_equal(one[column], two[column])
    write_recording(one, tmp_path / "fit.csv")
    line = (tmp_path / "fit.csv").read_text().splitlines()[1]
    assert line.startswith("0,")
    assert max(len(cell.lstrip("-").replace(".", "")) for cell in line.split(",")) <= 14


@pytest.mark.validate
def test_run_over_sampled_speeds_follows_the_smooth_program() -> None:
    robot = replace(paper_robot(), damping=np.full(3, 4e8))
    program = wander(robot, 3, 5.0)
    times = np.arange(0, 5.001, 0.01)
    speeds = np.array([program.speed(time) for time in times])
    smooth = simulate(robot, {}, program, [0.0, 5.0])
    sampled = simulate(robot, {}, SampledProgram(times, speeds), [0.0, 5.0])
    assert smooth.position[-1] == pytest.approx(sampled.position[-1], abs=2e-5)


def test_rig_shares_no_code_with_the_project() -> None:
    for source in Path(__file__).parent.glob("*.py"):
        imported = [line for line in source.read_text().splitlines() if line.lstrip().startswith(("import", "from"))]
        assert not [line for line in imported if "tautwire" in line], source.name
