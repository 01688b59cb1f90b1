"""Partial derivatives in model exchange, beside central differences of the same instance."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from numpy.typing import NDArray

from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Formula
from tests.support.effect_cases import CASES, UNLISTED_CASES, Case
from tests.support.effects import with_effects
from tests.support.fmus import in_hand
from tests.support.model_exchange import Model, in_model_exchange
from tests.support.native import DIFFERENTIATED
from tests.support.robots import example

Array = NDArray[np.float64]

# Of the largest derivative of each unknown.
EXACT = 1e-9
# Of strains, which are quotients of lengths less one.
STRAIN_ROUNDING = 1e-14
# Sizes of random changes of inputs, and steps of the differences.
SIZES = {
    "position": (2e-3, 1e-3),
    "velocity": (0.5, 1e-2),
    "acceleration": (2.0, 1e-2),
    "winch_speed": (0.3, 1e-4),
    "winch_acceleration": (1.0, 1e-2),
    "speed_command": (5e-3, 1e-4),
    "force": (300.0, 1.0),
    "external": (200.0, 1.0),
}
# Weights of the values at one to four steps, of the eighth order.
WEIGHTS = np.array([4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0])
# The same of states: of lengths in metres, of all others in their nominal values.
STATE_SIZES = {
    "unstrained_length": (2e-3, 1e-3),
    "wound_length": (2e-3, 1e-3),
    "velocity": (0.5, 5e-3),
    "effect.creep": (1e-6, 2e-6),
    "effect": (1e-4, 1e-4),
}
OTHER_STATE_SIZE = (5e-3, 1e-4)


def unknowns_of(model: Model) -> list[str]:
    outputs = [v.name for v in model.description.modelVariables if v.causality == "output"]
    return [*outputs, *(f"der({name})" for name in model.state_names)]


def knowns_of(model: Model) -> list[str]:
    return [*inputs_of(model), *model.state_names]


def inputs_of(model: Model) -> list[str]:
    return [v.name for v in model.description.modelVariables if v.causality == "input"]


def sizes_of(model: Model) -> Array:
    """Of each known the size of its random change and the step of its difference, (n, 2)."""
    inputs = [_sizes_by_start(name, SIZES, (0.0, 1.0)) for name in inputs_of(model)]
    states = np.array([_sizes_by_start(name, STATE_SIZES, OTHER_STATE_SIZE) for name in model.state_names])
    is_length = np.isin(model.state_names, list(STATE_SIZES))
    return np.concatenate([inputs, states * np.where(is_length, 1.0, model.nominals())[:, None]])


def _sizes_by_start(
    name: str, sizes: Mapping[str, tuple[float, float]], absent: tuple[float, float]
) -> tuple[float, float]:
    return next((size for start, size in sizes.items() if name.startswith(start)), absent)


def jacobian(model: Model) -> Array:
    """Of all unknowns, by rows, with respect to all knowns."""
    unknowns, knowns = ([model.references[n] for n in names(model)] for names in (unknowns_of, knowns_of))
    return np.array([model.fmu.getDirectionalDerivative(unknowns, [known], [1.0]) for known in knowns]).T


def differences(model: Model, time: float) -> Array:
    """The same by central differences of the eighth order, with steps so short that no kink is in between."""
    states, inputs = model.states(), inputs_of(model)
    values = np.array(model.get(*inputs))
    signs = np.sign(model.indicators())

    def shown(change: Array) -> Array | None:
        model.go_to(time, states + change[len(inputs) :])
        model.set(dict(zip(inputs, values + change[: len(inputs)], strict=True)))
        is_smooth = np.array_equal(np.sign(model.indicators()), signs)
        return np.array(model.get(*unknowns_of(model))) if is_smooth else None

    def column(unit: Array, step: float) -> Array:
        ends = [shown(k * step * unit) for k in (1, 2, 3, 4, -1, -2, -3, -4)]
        if any(end is None for end in ends):
            return column(unit, 0.25 * step)
        return WEIGHTS @ (np.array(ends[:4]) - np.array(ends[4:])) / step

    steps = sizes_of(model)[:, 1]
    columns = [column(unit, step) for unit, step in zip(np.eye(len(steps)), steps, strict=True)]
    shown(np.zeros(len(steps)))
    return np.array(columns).T


def shake(model: Model, time: float) -> None:
    """Change inputs and states by random numbers, away from the kinks of the start."""
    sizes, inputs = sizes_of(model)[:, 0], inputs_of(model)
    changes = sizes * np.random.default_rng(3).uniform(-1.0, 1.0, len(sizes))
    model.set(dict(zip(inputs, np.array(model.get(*inputs)) + changes[: len(inputs)], strict=True)))
    model.go_to(time, model.states() + changes[len(inputs) :])


def assert_exact(model: Model, time: float) -> Array:
    """Hold the derivatives against differences; gives them."""
    shown, expected = jacobian(model), differences(model, time)
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    is_strain = np.array(unknowns_of(model))[:, None] == "strain"
    rounding = np.where(is_strain, STRAIN_ROUNDING / sizes_of(model)[:, 1], 0.0)
    assert np.all(np.abs(shown - expected) <= EXACT * scale + rounding)
    return shown


@pytest.fixture(scope="module")
def fmus_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, int], RobotFmus]:
    """Native FMUs of a robot by its name, of a version of FMI."""
    built: dict[tuple[str, int], RobotFmus] = {}

    def fmus(name: str, fmi: int = 2) -> RobotFmus:
        if (name, fmi) not in built:
            folder = tmp_path_factory.mktemp(name)
            built[name, fmi] = build_fmus(DIFFERENTIATED[name], folder, native=True, fmi=fmi)
        return built[name, fmi]

    return fmus


def paths_of(fmus: RobotFmus) -> list[Path]:
    """One of each kind."""
    return [path for path in (fmus.platform, fmus.cables[0], *fmus.winches[:1]) if path is not None]


@pytest.mark.parametrize("name", ["several", "delayed", "rigid"])
def test_they_are_those_of_rates_and_outputs(name: str, fmus_of: Callable[..., RobotFmus]) -> None:
    for path in paths_of(fmus_of(name)):
        with in_model_exchange(path) as model:
            model.run()
            shake(model, 0.01)
            shown = assert_exact(model, 0.01)
            if "pull" in model.references:
                assert model.get("pull")[0] > 100.0
            assert np.count_nonzero(shown[: -model.state_count]) > 5 and np.any(shown[-model.state_count :])


@pytest.mark.validate
@pytest.mark.parametrize("case", (*CASES, *UNLISTED_CASES, None), ids=str)
def test_those_of_each_effect_and_of_all_together_are_exact(case: Case | None, tmp_path: Path) -> None:
    fmus = build_fmus(with_effects(example("three"), *(CASES if case is None else [case])), tmp_path, native=True)
    number = 1 if case is None else (case.cables or (1,))[0]
    for path in (fmus.platform, fmus.cables[number - 1]):
        with in_model_exchange(path) as model:
            assert np.isfinite(jacobian(model)).all()
            model.run()
            shake(model, 0.01)
            assert_exact(model, 0.01)


def test_a_quaternion_that_drifts_from_length_one_turns_by_them_too(fmus_of: Callable[..., RobotFmus]) -> None:
    with in_model_exchange(fmus_of("rigid").platform) as model:
        model.run()
        shake(model, 0.1)
        model.go_to(0.1, model.states() * np.array([*[1.03] * 4, *[1.0] * 9]))
        shown = assert_exact(model, 0.1)
        columns = [knowns_of(model).index(f"orientation.{part}") for part in "wxyz"]
        radial = shown[:, columns] @ model.states()[:4]
        assert np.max(np.abs(radial[unknowns_of(model).index("position_1.x")])) < 1e-12


def test_a_sensor_that_lags_follows_what_is_later_than_the_last_step_alone(
    fmus_of: Callable[..., RobotFmus],
) -> None:
    """Steps that are shorter than the lag show what is past, longer ones what they go to."""
    fmus = fmus_of("delayed")
    for path, late in ((fmus.platform, "measured_position.x"), (fmus.cables[0], "tension")):
        with in_model_exchange(path) as model:
            row = unknowns_of(model).index(late)
            at_once = jacobian(model)[row]
            model.run()
            for time in (0.01, 0.1):
                shake(model, time)
                shown = assert_exact(model, time)[row]
                assert np.any(at_once) and np.any(shown) == (time == 0.1)
                assert not np.array_equal(shown, at_once)


@pytest.mark.validate(but=["several"])
@pytest.mark.parametrize("name", ["several", "rigid"])
def test_a_direction_is_the_product_with_the_jacobian_and_an_adjoint_that_with_its_transpose(
    name: str, fmus_of: Callable[..., RobotFmus]
) -> None:
    random = np.random.default_rng(5)
    for path, other in zip(paths_of(fmus_of(name)), paths_of(fmus_of(name, 3)), strict=True):
        with in_model_exchange(path) as model, in_model_exchange(other) as latter:
            for each in (model, latter):
                each.run()
                shake(each, 0.01)
            expected = jacobian(model)
            assert np.array_equal(jacobian(latter), expected)
            unknowns, knowns = ([model.references[n] for n in names(model)] for names in (unknowns_of, knowns_of))
            seed, adjoint_seed = (random.standard_normal(len(each)) for each in (knowns, unknowns))
            shown = model.fmu.getDirectionalDerivative(unknowns, knowns, list(seed))
            adjoint = latter.fmu.getAdjointDerivative(unknowns, knowns, list(adjoint_seed), len(knowns))
        for one, product in ((shown, expected @ seed), (adjoint, expected.T @ adjoint_seed)):
            assert np.allclose(one, product, rtol=1e-12, atol=1e-12 * np.max(np.abs(product)))


@pytest.mark.validate(but=["2"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_they_are_zero_where_the_model_structure_has_no_dependency(fmi: int, fmus_of: Callable[..., RobotFmus]) -> None:
    for path in [each for name in ("several", "delayed", "rigid") for each in paths_of(fmus_of(name, fmi))]:
        with in_model_exchange(path) as model:
            model.run()
            shake(model, 0.1)
            unknowns, knowns = unknowns_of(model), knowns_of(model)
            listed = [*model.description.outputs, *model.description.derivatives]
            depends = {
                each.variable.name: set(knowns) if each.dependencies is None else {k.name for k in each.dependencies}
                for each in listed
            }
            shown = {(unknowns[row], knowns[column]) for row, column in np.argwhere(jacobian(model))}
            assert shown and all(known in depends[unknown] for unknown, known in shown)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("unknown", "known", "message"),
    [
        ("modulus", "position.x", "modulus is no output and no rate of a state"),
        ("event_indicator_1", "position.x", "event_indicator_1 is no output and no rate of a state"),
        ("unstrained_length", "position.x", "unstrained_length is no output and no rate of a state"),
        ("force.x", "modulus", "modulus is no input and no state"),
        ("force.x", "der(wound_length)", "der(wound_length) is no input and no state"),
        ("nothing", "position.x", "no real variable has the value reference 9999"),
    ],
)
def test_others_are_refused(
    unknown: str,
    known: str,
    message: str,
    fmi: int,
    fmus_of: Callable[..., RobotFmus],
    capsys: pytest.CaptureFixture[str],
) -> None:
    with in_model_exchange(fmus_of("several", fmi).cables[0]) as model:
        model.run()
        model.references["nothing"] = 9999
        for call in ("Directional", "Adjoint")[: fmi - 1]:
            arguments = (
                [model.references[unknown]],
                [model.references[known]],
                [1.0],
                *([1] if call == "Adjoint" else []),
            )
            with pytest.raises(FMICallException):
                getattr(model.fmu, f"get{call}Derivative")(*arguments)
            assert message in capsys.readouterr().out


def test_by_fmi_3_there_are_those_with_respect_to_the_time(tmp_path: Path) -> None:
    robot = replace(example("three"), formulas=(Formula("force_x", "300*time*sin(2*time)"),))
    time, step = 0.7, 1e-2
    with in_model_exchange(build_fmus(robot, tmp_path, native=True, fmi=3).platform, 0.2) as model:
        model.run()
        states, unknowns = model.states(), unknowns_of(model)

        def shown(at: float) -> Array:
            model.go_to(at, states)
            return np.array(model.get(*unknowns))

        steps = step * np.arange(1, 5)
        expected = WEIGHTS @ np.array([shown(time + each) - shown(time - each) for each in steps]) / step
        model.go_to(time, states)
        known, references = model.references["time"], [model.references[name] for name in unknowns]
        direction = np.array(model.fmu.getDirectionalDerivative(references, [known], [2.0]))
        (adjoint,) = model.fmu.getAdjointDerivative(references, [known], [1.0] * len(references), 1)
        with pytest.raises(FMICallException):
            model.fmu.getDirectionalDerivative([known], [known], [1.0])
    assert direction == pytest.approx(2.0 * expected, rel=EXACT, abs=1e-12) and np.any(expected)
    assert adjoint == pytest.approx(np.sum(expected), rel=EXACT)


@pytest.mark.validate
def test_what_a_lagging_sensor_shows_has_none_with_respect_to_the_time(fmus_of: Callable[..., RobotFmus]) -> None:
    with in_model_exchange(fmus_of("delayed", 3).cables[0]) as model:
        model.run()
        shake(model, 0.01)
        unknowns = unknowns_of(model)
        references = [model.references[name] for name in unknowns]
        known = model.references["time"]
        shown = model.fmu.getDirectionalDerivative(references, [known], [1.0])
        seed = [float(name not in ("tension", "tension_rate")) for name in unknowns]
        (adjoint,) = model.fmu.getAdjointDerivative(references, [known], seed, 1)
    assert adjoint == pytest.approx(np.nansum(shown))
    unknown = {name for name, value in zip(unknowns, shown, strict=True) if np.isnan(value)}
    assert unknown == {"tension", "tension_rate"}


def test_in_co_simulation_there_are_none_of_rates_and_states(
    fmus_of: Callable[..., RobotFmus], capsys: pytest.CaptureFixture[str]
) -> None:
    with in_hand(fmus_of("several").cables[0]) as cable:
        cable.run()
        for unknown, known, what in (
            ("der(wound_length)", "winch_speed", "output"),
            ("force.x", "wound_length", "input"),
        ):
            with pytest.raises(FMICallException):
                cable.fmu.getDirectionalDerivative([cable.references[unknown]], [cable.references[known]], [1.0])
            assert f"is no {what}: derivatives are those of outputs with respect to inputs" in capsys.readouterr().out


def test_where_the_law_has_no_value_they_are_not_a_number(fmus_of: Callable[..., RobotFmus]) -> None:
    with in_model_exchange(fmus_of("several").cables[0]) as model:
        model.run()
        states, before = model.states(), jacobian(model)
        model.go_to(0.1, np.array([-1.0, *states[1:]]))
        assert np.isnan(jacobian(model)).all()
        model.go_to(0.0, states)
        assert np.array_equal(jacobian(model), before)


def test_model_descriptions_promise_them(fmus_of: Callable[..., RobotFmus]) -> None:
    former, latter = (fmus_of("several", fmi) for fmi in (2, 3))
    for path, names in (
        *((path, ["providesDirectionalDerivative"]) for path in paths_of(former)),
        *((path, ["providesDirectionalDerivatives", "providesAdjointDerivatives"]) for path in paths_of(latter)),
    ):
        with zipfile.ZipFile(path) as archive:
            interface = ElementTree.fromstring(archive.read("modelDescription.xml")).find("ModelExchange")
        assert interface is not None and [interface.get(name) for name in names] == ["true"] * len(names)
        assert validate_fmu(str(path)) == []
