"""A program that tells effects apart, within its limits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.errors import InputError
from tautwire.estimation import input_design, worker_pool
from tautwire.estimation.excitation_limits import ExcitationLimits, default_limits
from tautwire.estimation.input_design import DesignOptions, ExcitationError, design_excitation, effects_by_name
from tautwire.estimation.multisine import MultisinePath
from tautwire.robot.pose_trajectory import PoseTrajectory
from tautwire.robot.reference_simulation import integrate
from tautwire.robot.schema import Robot, Sensors
from tautwire.robot.winch_speeds import ideal_winch_speeds
from tests.support.rigid_robots import crane_robot, octahedral_robot
from tests.support.robots import EXAMPLES, example

THREE = example("three")
LIMITS = ExcitationLimits(speed=0.8, reach=3.0, min_tension=300.0, max_tension=5000.0)


def quiet(what: str, done: float) -> None:
    """No progress."""


def test_a_path_of_sines_begins_and_ends_at_rest_and_has_its_own_derivatives() -> None:
    path = MultisinePath((1.0, 2.0, 3.0), 10.0, ((0.2, 0.1, 0.3),), ((0.4, 0.7, 0.2),))
    times = np.linspace(0.0, 10.0, 20_001)
    position, velocity, acceleration = path.position(times), path.velocity(times), path.acceleration(times)
    for end in (0, -1):
        assert position[end] == pytest.approx((1.0, 2.0, 3.0), abs=1e-12)
        assert velocity[end] == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert np.allclose(np.gradient(position, times, axis=0)[1:-1], velocity[1:-1], atol=1e-5)
    assert np.allclose(np.gradient(velocity, times, axis=0)[1:-1], acceleration[1:-1], atol=3e-3)
    assert np.max(np.abs(path.scaled(0.5).position(times) - position[0])) < np.max(np.abs(position - position[0]))


@pytest.mark.parametrize(("programs", "tried"), [(96, 96), (64, 64), (1, 32)])
def test_as_many_programs_are_tried_as_are_asked_for_and_progress_counts_them(programs: int, tried: int) -> None:
    class Bowl:
        options, robot = DesignOptions(LIMITS, 3.0, 0.05, programs), THREE

        @staticmethod
        def score(decision_variables: np.ndarray) -> float:
            assert np.all((decision_variables >= 0.0) & (decision_variables <= 1.0))
            return -float(np.sum((decision_variables - 0.3) ** 2))

    reported: list[tuple[str, float]] = []
    best, scores = input_design._search(Bowl(), lambda *report: reported.append(report))  # type: ignore[arg-type]
    assert Bowl.score(best) == max(scores) and len(scores) == tried
    # Programs near the best one are better than any that were spread.
    assert max(scores) > max(scores[:32]) or tried == 32
    shares = [share for what, share in reported if what == "trying programs"]
    assert len(shares) == len(reported) and shares[0] == 0.0 and shares == sorted(set(shares)) and shares[-1] < 1.0


def test_what_programs_call_is_compiled_before_processes_are_forked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of them would compile it again."""
    scored: list[np.ndarray] = []

    class Flat:
        options, robot = DesignOptions(LIMITS, 3.0, 0.05, 1), THREE

        @staticmethod
        def score(decision_variables: np.ndarray) -> float:
            scored.append(decision_variables)
            return 0.0

    def in_forks(_: object, items: list[np.ndarray], __: object) -> list[float]:
        assert len(scored) == 1 and not np.any(scored[0])
        return [0.0 for _ in items]

    monkeypatch.setattr(input_design, "map_in_forks", in_forks)
    _, scores = input_design._search(Flat(), quiet)  # type: ignore[arg-type]
    assert len(scores) == 32


def test_progress_advances_with_each_effect_that_is_compiled() -> None:
    reported: list[tuple[str, float]] = []
    options, effects = DesignOptions(LIMITS, 3.0, 0.05, 1), effects_by_name(THREE, "damping,payload,drag")
    input_design._design_problem(THREE, effects, options, lambda *report: reported.append(report))
    shares = [share for _, share in reported]
    assert {what for what, _ in reported} == {"compiling the filter"}
    assert shares[0] == 0.0 and shares == sorted(set(shares)) and len(shares) == 4 and shares[-1] < 0.2


@pytest.mark.parametrize("nats", [float("nan"), float("inf")])
def test_a_program_whose_separation_is_no_number_is_none_of_the_best(
    monkeypatch: pytest.MonkeyPatch, nats: float
) -> None:
    effects = effects_by_name(THREE, "damping,payload")
    problem = input_design._design_problem(THREE, effects, DesignOptions(LIMITS, 3.0, 0.05, 1), quiet)
    decision_variables = np.full(18, 0.3)
    assert problem.score(decision_variables) > input_design.INFEASIBLE_SCORE
    unknown = input_design.EffectSeparation(*effects, nats)
    monkeypatch.setattr(input_design._DesignProblem, "separations", lambda self, recording: [unknown])
    assert problem.score(decision_variables) == input_design.INFEASIBLE_SCORE


def test_a_path_shrinks_until_it_keeps_the_limits_and_finely_no_more_than_they_need() -> None:
    options = DesignOptions(replace(LIMITS, speed=0.5), 3.0, 0.05, 1)
    problem = input_design._design_problem(THREE, effects_by_name(THREE, "damping,payload"), options, quiet)
    decision_variables = np.random.default_rng(0).uniform(size=18)
    factors = (input_design.SHRINK_FACTOR, input_design.FINE_SHRINK_FACTOR)
    paths = [problem.program(decision_variables, factor)[0] for factor in factors]
    coarse, fine = (path for path in paths if isinstance(path, MultisinePath))
    gain = np.array(fine.amplitudes) / np.array(coarse.amplitudes)
    assert gain == pytest.approx(gain[0, 0]) and 1.05 < gain[0, 0] < 1.0 / factors[0]
    assert problem._simulated_within_limits(fine.scaled(1.0 / factors[1])) is None


def test_a_path_that_is_far_too_fast_is_refused_by_a_few_of_its_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    counts: list[int] = []

    def counted(robot: Robot, path: MultisinePath, time: np.ndarray) -> np.ndarray:
        counts.append(len(time))
        return ideal_winch_speeds(robot, path, time)

    monkeypatch.setattr(input_design, "ideal_winch_speeds", counted)
    options = DesignOptions(LIMITS, 10.0, 0.05, 1)
    problem = input_design._DesignProblem(THREE, (), options, None, ())  # type: ignore[arg-type]
    path = MultisinePath(THREE.platform.start, 10.0, ((9.0, 0.0, 0.0),), ((0.4, 0.4, 0.4),))
    assert problem._simulated_within_limits(path) is None and counts == [13]
    # Between those few samples one is too fast.
    speeds = counted(THREE, path.scaled(0.01), 0.05 * np.arange(201))
    fastest = float(np.max(np.abs(speeds)))
    assert np.max(np.abs(speeds[::16])) < fastest
    problem = replace(problem, options=replace(options, limits=replace(LIMITS, speed=0.9999 * fastest)))
    assert problem._simulated_within_limits(path.scaled(0.01)) is None and counts[-2:] == [13, 201]


@pytest.mark.validate
def test_coarse_integration_steps_leave_separations_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, decision_variables = example("caroca"), np.random.default_rng(3).uniform(size=18)
    effects, options = effects_by_name(robot, "damping,relaxation"), DesignOptions(default_limits(robot), 10.0, 0.02, 1)
    designs = [input_design._design_problem(robot, effects, options, quiet)]
    monkeypatch.setattr(input_design, "MAX_STATE_ANGLE", None)
    designs.append(input_design._design_problem(robot, effects, options, quiet))
    coarse, fine = (design.likelihood._filter_functions._substeps.state for design in designs)
    assert coarse < 0.25 * fine
    recordings = [design.program(decision_variables)[1] for design in designs]
    tensions = [recording.tension for recording in recordings]
    assert np.max(np.abs(tensions[0] - tensions[1])) < 0.01
    nats = [[pair.nats for pair in design.separations(each)] for design, each in zip(designs, recordings, strict=True)]
    assert nats[0] == pytest.approx(nats[1], rel=5e-4)


@pytest.mark.validate
def test_the_best_program_is_within_the_limits_and_better_than_most(monkeypatch: pytest.MonkeyPatch) -> None:
    effects = effects_by_name(THREE, "damping,relaxation")
    found = design_excitation(THREE, effects, DesignOptions(LIMITS, 3.0, 0.05, 10, 1), quiet)
    assert np.max(np.abs(found.winch_speed)) <= 0.8
    assert found.winch_speed[0] == pytest.approx(0.0, abs=1e-12)
    run = integrate(THREE, found.time, found.winch_speed)
    assert np.min(run.tension) > 299.0
    assert np.max(run.tension) < 5001.0
    # A slightly larger motion would break a limit.
    assert isinstance(found.path, MultisinePath)
    larger = ideal_winch_speeds(THREE, found.path.scaled(1.05), found.time)
    assert np.max(np.abs(larger)) > 0.8 or np.min(integrate(THREE, found.time, larger).tension) < 300.0
    assert [pair.nats for pair in found.pairs] == sorted(pair.nats for pair in found.pairs)
    assert found.pairs[0].nats > 1.2 * found.median_separation
    assert all(pair.effect.effect is not pair.other.effect for pair in found.pairs)
    other_count = 1 if worker_pool.processors() > 1 else 2
    monkeypatch.setattr(worker_pool, "processors", lambda: other_count)
    again = design_excitation(THREE, effects, DesignOptions(LIMITS, 3.0, 0.05, 10, 1), quiet)
    assert np.array_equal(again.winch_speed, found.winch_speed)


def test_limits_that_no_program_keeps_are_an_error() -> None:
    narrow = ExcitationLimits(speed=0.5, reach=1.0, min_tension=1e4, max_tension=1.1e4)
    with pytest.raises(ExcitationError, match=r"none of \d+ programs"):
        design_excitation(
            THREE, effects_by_name(THREE, "damping,payload"), DesignOptions(narrow, 2.0, 0.1, 1, 1), quiet
        )


@pytest.mark.parametrize(
    ("names", "part"), [("damping", "fewer than two"), ("damping,wobble", "'wobble' is not an effect")]
)
def test_effects_that_cannot_be_told_apart_are_refused(
    names: str, part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, out = EXAMPLES / "three" / "robot.toml", tmp_path / "p.csv"
    assert run(["excite", str(robot), "--effects", names, "--out", str(out)]) == 2
    assert part in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.validate
def test_a_platform_that_six_cables_turn_is_turned_too() -> None:
    noises = Sensors(position_noise=2e-4, tension_noise=1.0, orientation_noise=1e-3)
    robot = replace(octahedral_robot(), sensors=noises)
    limits = default_limits(robot)
    effects = effects_by_name(robot, "damping,inertia")
    found = design_excitation(robot, effects, DesignOptions(limits, 2.0, 0.05, 1), quiet)
    assert isinstance(found.path, PoseTrajectory)
    rotation = found.path.rotation.rotation_vector.position(found.time)
    assert np.max(np.abs(rotation)) > 0.001 and not np.any(rotation[[0, -1]])
    assert np.max(np.abs(found.winch_speed)) <= limits.speed
    assert found.pairs[0].nats > 0.0


@pytest.mark.parametrize(
    ("robot", "missing"),
    [
        (octahedral_robot(), "position_noise and tension_noise and orientation_noise are not"),
        (replace(THREE, sensors=replace(THREE.sensors, tension_noise=0.0)), "tension_noise is not"),
    ],
)
def test_a_robot_whose_noise_is_not_declared_is_refused(robot: Robot, missing: str) -> None:
    """Noise estimated from what a simulation leaves would make the wildest program the best one."""
    effects = effects_by_name(robot, "damping,relaxation")
    with pytest.raises(InputError, match=rf"\[sensors\] of {robot.name}: {missing} declared"):
        design_excitation(robot, effects, DesignOptions(default_limits(robot), 2.0, 0.05, 1), quiet)


def test_rotations_stay_within_their_limit_and_shrink_with_the_path() -> None:
    robot = crane_robot()
    limits = default_limits(robot)
    assert limits.turn == pytest.approx(0.2)
    options = DesignOptions(limits, 10.0, 0.05, 1)
    problem = input_design._DesignProblem(robot, (), options, None, ())  # type: ignore[arg-type]
    times = np.linspace(0.0, 10.0, 501)
    paths = [problem._path(np.random.default_rng(5).uniform(size=36), scale) for scale in (1.0, 0.5)]
    turns = [path.rotation.rotation_vector.position(times) for path in paths if isinstance(path, PoseTrajectory)]
    assert 0.02 < np.max(np.abs(turns[0])) <= limits.turn
    assert turns[1] == pytest.approx(0.5 * turns[0])
    assert not np.any(paths[0].angular_velocity(times[[0, -1]]))  # type: ignore[attr-defined]
