"""Functions over samples against CasADi's own interpreter, to the last bit."""

from dataclasses import replace

import casadi
import numpy as np
import pytest
from casadi import SX, Function

from tautwire.estimation.integration_steps import Substeps
from tautwire.estimation.kalman_filter import (
    output_function,
    preparation_function,
    slope_function,
    static_start_function,
    trajectory_function,
)
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.native_functions import CompiledFunction, by_sample
from tautwire.robot.symbolic_model import FreeParameter, symbolic_model
from tests.support.effect_cases import CASES, UNLISTED_CASES, Case
from tests.support.memory import TOLD, resident_memory
from tests.support.recordings import recorded
from tests.support.robots import example

GENERATOR = np.random.default_rng(1)


def falling() -> Function:
    """Carries a state (2) and a matrix (2, 2); takes a step and a constant vector; sparse on purpose."""
    state, matrix, step, pull = SX.sym("state", 2), SX.sym("matrix", 2, 2), SX.sym("step"), SX.sym("pull", 2)
    turned = casadi.vertcat(casadi.horzcat(1.0, step), casadi.horzcat(SX(1, 1), 1.0))
    after = casadi.mtimes(turned, state) + step * pull
    return Function("falling", [state, matrix, step, pull], [after, casadi.mtimes(turned, matrix), turned])


def test_a_function_is_taken_over_columns() -> None:
    a, b = SX.sym("a", 2, 3), SX.sym("b", 3)
    function = Function("product", [a, b], [casadi.mtimes(a, b), casadi.sin(b)])
    many, vectors = GENERATOR.normal(size=(2, 3 * 7)), GENERATOR.normal(size=(3, 7))
    for ours, theirs in zip(CompiledFunction(function)(7, many, vectors), function.map(7)(many, vectors), strict=True):
        np.testing.assert_array_equal(ours, np.array(theirs))


def test_results_are_carried_to_the_next_sample() -> None:
    state, matrix = GENERATOR.normal(size=(2, 1)), GENERATOR.normal(size=(2, 2))
    steps, pull = GENERATOR.normal(size=(1, 5)), GENERATOR.normal(size=(2, 1))
    ours = CompiledFunction(falling(), carried=2)(5, state, matrix, steps, pull)
    theirs = falling().mapaccum("run", 5, 2)(state, matrix, steps, np.repeat(pull, 5, axis=1))
    np.testing.assert_array_equal(ours[0], np.hstack([state, np.array(theirs[0])]))
    np.testing.assert_array_equal(ours[1], np.hstack([matrix, np.array(theirs[1])]))
    np.testing.assert_array_equal(ours[2], np.array(theirs[2]))


def test_no_samples_give_what_was_carried() -> None:
    state, matrix = np.ones((2, 1)), np.eye(2)
    found = CompiledFunction(falling(), carried=2)(0, state, matrix, np.zeros((1, 0)), np.zeros((2, 0)))
    assert [result.shape for result in found] == [(2, 1), (2, 2), (2, 0)]
    np.testing.assert_array_equal(found[1], matrix)


def test_arguments_of_other_sizes_are_refused() -> None:
    repeated = CompiledFunction(falling(), carried=2)
    with pytest.raises(ValueError, match=r"shape \(1, 4\), where \(1, 1\) is one of 5 samples"):
        repeated(5, np.ones((2, 1)), np.eye(2), np.ones((1, 4)), np.ones((2, 1)))


def test_what_is_carried_has_to_fit() -> None:
    repeated = CompiledFunction(falling(), carried=2)
    with pytest.raises(ValueError, match=r"shape \(2, 1\), where \(2, 2\) is one of 1 samples"):
        repeated(5, np.ones((2, 1)), np.ones((2, 1)), np.ones((1, 5)), np.ones((2, 1)))
    with pytest.raises(ValueError, match="3 results of falling are to be carried"):
        CompiledFunction(falling(), carried=3)


@pytest.mark.parametrize("count", [0, 1, 6])
def test_what_is_interpreted_is_the_same(count: int) -> None:
    state, matrix = GENERATOR.normal(size=(2, 1)), GENERATOR.normal(size=(2, 2))
    steps, pull = GENERATOR.normal(size=(1, count)), GENERATOR.normal(size=(2, 1))
    for carried, first in ((2, (state, matrix)), (0, (np.tile(state, count), matrix))):
        ways = [CompiledFunction(falling(), carried, most)(count, *first, steps, pull) for most in (0, 10_000)]
        for one, other in zip(*ways, strict=True):
            np.testing.assert_array_equal(one, other)


def test_results_are_stacked_by_sample() -> None:
    wide = np.arange(12.0).reshape(2, 6)
    np.testing.assert_array_equal(by_sample(wide, 3)[1], wide[:, 2:4])
    assert by_sample(np.zeros((2, 0)), 3).shape == (3, 2, 0)
    assert by_sample(np.zeros((0, 6)), 3).shape == (3, 0, 2)


@pytest.mark.validate
@pytest.mark.skipif(not TOLD, reason="only Linux tells the memory of a process")
def test_functions_that_are_kept_take_little_memory() -> None:
    a = SX.sym("a", 16, 16)
    function = Function("cube", [a], [casadi.mtimes(a, casadi.mtimes(a, a))])
    kept = [CompiledFunction(function)]
    before, _ = resident_memory()
    kept += [CompiledFunction(function) for _ in range(10)]
    after, _ = resident_memory()
    # 17,000 instructions, of some twenty bytes each.
    assert after - before < 10 * 3.0
    assert len(kept) == 11


@pytest.mark.parametrize("case", (*CASES, *UNLISTED_CASES), ids=str)
def test_the_filter_functions_of_every_effect_are_casadis_to_the_last_bit(case: Case) -> None:
    robot, recording = example("three"), recorded("three", 1)
    noise, count = estimate_noise(robot, recording), 50
    model = symbolic_model(
        replace(robot, effects=(case.setting(robot),)), [FreeParameter(0, name) for name in case.law]
    )
    theta = np.array(list(case.law.values()))[:, None]
    start = np.array(Function("start", [model.parameters], [model.start])(theta))
    speeds = (recording.winch_speed[:count].T, recording.winch_speed[1 : count + 1].T)
    bends, step = np.full((6, 1), 1e-3), np.diff(recording.time[: count + 1])[None, :]
    substeps, nothing, zero = Substeps(5, 1), np.zeros((0, 1)), np.zeros((1, 1))
    statics = np.array(static_start_function(model).call([theta, []])[0])
    constants, _ = preparation_function(model, noise).call([start, theta, statics, 0.02, []])
    moving = (start, np.array(constants))
    for function, columns in (
        (output_function(model, 3, noise), (start, theta, statics, np.zeros((6, 1)), *speeds, step, nothing)),
        (static_start_function(model), (np.tile(theta, count), nothing)),
        (preparation_function(model, noise), (start, theta, statics, step, nothing)),
        (trajectory_function(model, 3, noise, substeps), (*moving, *speeds, bends, step, zero)),
        (slope_function(model, 3, noise, substeps), (*moving, *speeds, zero)),
    ):
        arguments = [np.tile(a, count) if a.shape[1] == 1 else a for a in columns]
        ours = CompiledFunction(function)(count, *columns)
        for a, b in zip(ours, function.map(count).call(arguments), strict=True):
            np.testing.assert_array_equal(a, np.array(b))
            assert np.all(np.isfinite(a))
