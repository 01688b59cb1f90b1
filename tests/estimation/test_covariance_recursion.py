"""The covariance recursion against the Kalman filter of textbooks, which updates with all outputs at once."""

from __future__ import annotations

import ast
from hashlib import sha256
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from casadi import SX, Function, horzcat, mtimes, vertcat
from numpy.typing import NDArray

from tautwire.estimation import covariance_recursion, disturbance_recursion, step_integration
from tautwire.estimation.covariance_recursion import (
    Functions,
    Moments,
    Record,
    Samples,
    empty_record,
    recursion_buffers,
    run_recursion,
)
from tautwire.estimation.native_functions import BoundFunction, CompiledFunction
from tautwire.estimation.step_integration import Division, Integration, Step, integration_buffers

Array = NDArray[np.float64]

GENERATOR = np.random.default_rng(5)
# Two states that move by the first four, a constant, and two that decay; two parameters act on states and outputs.
SIZE, MOVING, FROM, OUTPUTS, PARAMETERS, COUNT = 5, 2, 4, 3, 2, 40
TRANSITION = GENERATOR.normal(size=(MOVING, FROM)) * 0.6
DIRECT = GENERATOR.normal(size=(MOVING, PARAMETERS))
DECAY = np.array([1.0, 1.0, 1.0, 0.7, 0.9])
PROCESS_NOISE = np.array([0.01, 0.02, 0.0, 0.3, 0.1])
BY_STATE = GENERATOR.normal(size=(OUTPUTS, SIZE)) * (GENERATOR.random((OUTPUTS, SIZE)) < 0.7)
BY_PARAMETERS = GENERATOR.normal(size=(OUTPUTS, PARAMETERS))
# Two numbers of the static start, which the constant and the parameters change.
STATICS, STATIC_VALUES = 2, np.array([3.0, -1.0])
STATICS_BY_CONSTANT, STATICS_BY_PARAMETERS = np.array([0.4, -0.7]), GENERATOR.normal(size=(PARAMETERS, 2))
STATES_BY_STATICS, OUTPUTS_BY_STATICS = GENERATOR.normal(size=(MOVING, 2)), GENERATOR.normal(size=(OUTPUTS, 2))
WHITE_VARIANCES = np.array([0.2, 0.5, 1.0])
MEASURED = GENERATOR.normal(size=(COUNT, OUTPUTS))
OBSERVED = (GENERATOR.random((COUNT, OUTPUTS)) < 0.8).astype(float)
# That of states that move acts from the start of a step on, that of the others at its end.
NOISE_AT_START = np.diag(np.where(np.arange(SIZE) < MOVING, PROCESS_NOISE, 0.0))
NOISE_AT_END = np.diag(PROCESS_NOISE) - NOISE_AT_START
FULL_TRANSITION = np.diag(DECAY)
FULL_TRANSITION[:MOVING] = 0.0
FULL_TRANSITION[:MOVING, :FROM] = TRANSITION
NO_OFFSET = np.zeros(SIZE)
START, START_COVARIANCE = GENERATOR.normal(size=SIZE), np.diag([1.0, 2.0, 0.5, 0.1, 0.3])


def bound_outputs(count: int, state: Array, static_values: Array) -> BoundFunction:
    """Outputs of a sample; what the static start changes of them is a part of what constant and parameters do."""
    x, held = SX.sym("x", SIZE), SX.sym("held", STATICS)
    other_by_state = BY_STATE.copy()
    other_by_state[:, MOVING] -= OUTPUTS_BY_STATICS @ STATICS_BY_CONSTANT
    other_by_parameters = BY_PARAMETERS - OUTPUTS_BY_STATICS @ STATICS_BY_PARAMETERS.T
    expected = mtimes(SX(other_by_state), x) + mtimes(SX(OUTPUTS_BY_STATICS), held - SX(STATIC_VALUES))
    results = [expected, SX(other_by_state), SX(np.hstack([other_by_parameters, OUTPUTS_BY_STATICS]))]
    return CompiledFunction(Function("outputs", [x, held], results)).bind(count, state[:, None], static_values)


def bound_static_start(count: int, state: Array) -> BoundFunction:
    """Numbers that follow linearly from the constant and the parameters, which are zero."""
    constant, by_others = SX.sym("constant"), horzcat(SX(STATICS_BY_PARAMETERS.T), SX(STATICS_BY_CONSTANT))
    results = [SX(STATIC_VALUES) + SX(STATICS_BY_CONSTANT) * constant, by_others]
    statics = CompiledFunction(Function("statics", [constant], results))
    return statics.bind(count, state[MOVING : MOVING + 1, None])


def bound(count: int, state: Array) -> tuple[BoundFunction, Integration, BoundFunction, list[BoundFunction]]:
    """Functions of a sample of a second; rates are constant in it, and their Jacobian is that of one part.

    The constants are two parameters, a driving state, an uncertain constant, and the static start.
    """
    x, number, held = SX.sym("x", SIZE), SX.sym("number"), SX.sym("held", STATICS)
    constants, moving = SX.sym("constants", PARAMETERS + 2 + STATICS), SX.sym("moving", MOVING)
    rates, by_statics = SX(TRANSITION[:, :MOVING]) - SX.eye(MOVING), SX(STATES_BY_STATICS)
    by_constant = SX(TRANSITION[:, MOVING] - STATES_BY_STATICS @ STATICS_BY_CONSTANT)
    by_driving = SX(TRANSITION[:, MOVING + 1])
    driven = by_driving * constants[PARAMETERS] + by_constant * constants[PARAMETERS + 1]
    shifted = mtimes(by_statics, constants[PARAMETERS + 2 :] - SX(STATIC_VALUES))
    by_parameters = SX(DIRECT - STATES_BY_STATICS @ STATICS_BY_PARAMETERS.T)
    part = Function("part", [moving, constants, number], [moving + mtimes(rates, moving) + driven + shifted])
    by_constants = horzcat(by_parameters, by_driving, by_constant, by_statics)
    slope = Function("slope", [moving, constants, number], [rates, by_constants])
    process = Function("process", [number], [SX(DECAY), SX(PROCESS_NOISE)])
    static_start = bound_static_start(count, state)
    prepared = [vertcat(SX(PARAMETERS, 1), x[3], x[2], held), SX(1)]
    preparation = CompiledFunction(Function("preparation", [x, held], prepared)).bind(
        count, state[:, None], static_start.results[0].T
    )
    buffers = [np.zeros((1, size)) for size in (MOVING, MOVING, 1)]
    of_part = CompiledFunction(part).bind(count, buffers[0].T, preparation.results[0].T, buffers[2])
    of_slope = CompiledFunction(slope).bind(count, buffers[1].T, preparation.results[0].T, buffers[2])
    division, steps = Division(1, 1, 1, 0), [step(each) for each in (preparation, of_part, of_slope)]
    results = (np.zeros((FROM, MOVING)), np.zeros((PARAMETERS, MOVING)), integration_buffers(steps[-1], division))
    integration = Integration(step(static_start), 1, *steps, division, *buffers, np.ones(count), *results)
    of_outputs = bound_outputs(count, state, static_start.results[0].T)
    of_process = CompiledFunction(process).bind(count, np.zeros((1, count)))
    return of_outputs, integration, of_process, [static_start, preparation, of_part, of_slope]


def step(function: BoundFunction) -> Step:
    return Step(function.address, function.places.ctypes.data, function.strides.ctypes.data, function.results)


def recursion(keeps_covariances: bool, prior_offset: np.ndarray = NO_OFFSET) -> tuple[Moments, Record]:
    """The moments after the last sample, and the record of a run that is linearised away from the prior mean."""
    sensitivities = np.zeros((PARAMETERS, SIZE))
    moments = Moments(START - prior_offset, prior_offset, START_COVARIANCE.copy(), sensitivities)
    record = empty_record((COUNT, OUTPUTS, SIZE, PARAMETERS), keeps_covariances)
    outputs, integration, process, _owners = bound(COUNT, moments.state)
    samples = Samples(MEASURED, OBSERVED, WHITE_VARIANCES)
    buffers = recursion_buffers(OUTPUTS, SIZE, PARAMETERS, integration)
    run_recursion(Functions(step(outputs), step(process)), integration, moments, samples, record, buffers)
    return moments, record


def test_states_covariances_and_likelihood_are_those_of_the_joint_update() -> None:
    moments, record = recursion(keeps_covariances=True)
    expected_state, expected_covariance = START.copy(), START_COVARIANCE.copy()
    for k in range(COUNT):
        assert record.states[k] == pytest.approx(expected_state, rel=1e-10, abs=1e-12)
        assert record.covariances[k] == pytest.approx(expected_covariance, rel=1e-10, abs=1e-12)
        assert record.transitions[k] == pytest.approx(FULL_TRANSITION, abs=1e-14)
        assert record.output_matrices[k] == pytest.approx(BY_STATE, abs=1e-14)
        seen = OBSERVED[k] > 0.0
        rows, noise = BY_STATE[seen], np.diag(WHITE_VARIANCES[seen])
        variance = rows @ expected_covariance @ rows.T + noise
        gain = expected_covariance @ rows.T @ np.linalg.inv(variance)
        error = MEASURED[k, seen] - rows @ expected_state
        assert np.sum(record.values[k, seen] ** 2) == pytest.approx(error @ np.linalg.solve(variance, error))
        assert np.sum(np.log(record.variances[k, seen])) == pytest.approx(np.linalg.slogdet(variance)[1])
        expected_state = FULL_TRANSITION @ (expected_state + gain @ error)
        updated = expected_covariance - gain @ rows @ expected_covariance + NOISE_AT_START
        expected_covariance = FULL_TRANSITION @ updated @ FULL_TRANSITION.T + NOISE_AT_END
    assert moments.state == pytest.approx(expected_state)
    assert moments.covariance == pytest.approx(expected_covariance)
    assert record.states[-1] == pytest.approx(expected_state)


def test_of_a_linear_model_it_does_not_matter_where_the_first_sample_is_linearised() -> None:
    offset = np.random.default_rng(2).normal(size=SIZE)
    (moments, record), (there, elsewhere) = (recursion(False, each) for each in (NO_OFFSET, offset))
    assert elsewhere.values == pytest.approx(record.values)
    assert there.state == pytest.approx(moments.state)
    assert elsewhere.states[0] == pytest.approx(record.states[0] - offset)


def test_sensitivities_are_derivatives_by_a_parameter_of_a_linear_model() -> None:
    """Of a linear model the gain does not depend on parameters, so that differences are exact."""
    moments, record = recursion(keeps_covariances=False)
    slopes = record.sensitivities
    for parameter in range(PARAMETERS):
        state, change = START_COVARIANCE.copy(), np.zeros(SIZE)
        for k in range(COUNT):
            seen = OBSERVED[k] > 0.0
            rows = BY_STATE[seen]
            variance = rows @ state @ rows.T + np.diag(WHITE_VARIANCES[seen])
            gain = state @ rows.T @ np.linalg.inv(variance)
            moved = -(rows @ change + BY_PARAMETERS[seen, parameter])
            assert np.sum(slopes[k, parameter, seen] ** 2) == pytest.approx(moved @ np.linalg.solve(variance, moved))
            change = FULL_TRANSITION @ (change + gain @ moved)
            change[:MOVING] += DIRECT[:, parameter]
            updated = state - gain @ rows @ state + NOISE_AT_START
            state = FULL_TRANSITION @ updated @ FULL_TRANSITION.T + NOISE_AT_END
        assert moments.sensitivities[parameter] == pytest.approx(change)


@pytest.mark.parametrize("module", [covariance_recursion, disturbance_recursion])
def test_cached_machine_code_follows_the_integration_that_it_calls(module: ModuleType) -> None:
    source = Path(step_integration.__file__).read_text(encoding="utf-8")
    digest = sha256(source.encode()).hexdigest()
    assert digest == module.STEP_INTEGRATION_SHA256, f"set STEP_INTEGRATION_SHA256 to {digest}"


@pytest.mark.parametrize("module", [step_integration, covariance_recursion, disturbance_recursion])
def test_no_compiled_loop_assigns_an_array_to_a_slice(module: ModuleType) -> None:
    """Numba would compile a message for sizes that differ into each: half as long again in all, at a first trace."""
    tree = ast.parse(Path(module.__file__ or "").read_text(encoding="utf-8"))
    loops = [each for each in tree.body if isinstance(each, ast.FunctionDef) and each.decorator_list]
    assignments = [each for loop in loops for each in ast.walk(loop) if isinstance(each, ast.Assign | ast.AugAssign)]
    slices = [
        ast.unparse(each)
        for each in assignments
        for target in (each.targets if isinstance(each, ast.Assign) else [each.target])
        if isinstance(target, ast.Subscript) and any(isinstance(part, ast.Slice) for part in ast.walk(target.slice))
        if not isinstance(each.value, ast.Constant)
    ]
    assert loops and not slices
