"""Partial derivatives of outputs with respect to inputs, beside complex steps through the Python laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import Feedforward, build_native_controller_fmu
from tautwire.fmus.component_resources import cable_resources, platform_resource, winch_resource
from tautwire.fmus.native.native_archive import python_slave
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.trajectory import Line
from tautwire_fmu.cable_slave import AppliedMotion, Cable
from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws import winch_drive
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, COMPLEX_STEP_SIZE
from tautwire_fmu.slave import Slave
from tests.support.fmus import Hand, in_hand
from tests.support.native import DIFFERENTIATED

Array = NDArray[np.float64]

PATH = Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 2.0)
FMI_WARNING = 1
STEP = 0.02
# Of the largest derivative of each output.
EXACT = 1e-9
MOTION = slice(2, 13)
CABLE_RATES = ("force_rate.x", "force_rate.y", "force_rate.z", "tension_rate")


@pytest.fixture(scope="module")
def fmus_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], RobotFmus]:
    """Native FMUs of a robot by its name."""
    built: dict[str, RobotFmus] = {}

    def fmus(name: str) -> RobotFmus:
        if name not in built:
            built[name] = build_fmus(DIFFERENTIATED[name], tmp_path_factory.mktemp(name), native=True)
        return built[name]

    return fmus


def twin_of(hand: Hand, kind: str, base: str, data: Mapping[str, Any], elapsed: float) -> Any:
    """The Python slave of an instance, with the values of all its variables."""
    slave: Any = python_slave(kind, base, {**data, "model_name": "twin", "guid": "", "version": ""})
    slave.started, slave.elapsed = True, elapsed
    slave.real = hand.get(*(variable.name for variable in slave.variables))
    return slave


def shake(hand: Hand, sizes: Mapping[str, float]) -> None:
    """Change inputs by random numbers, by the sizes of those whose names begin so."""
    random = np.random.default_rng(3)
    names = [name for name in hand.names("input") if name.startswith(tuple(sizes))]
    values = hand.get(*names)
    changes = [next(sizes[each] for each in sizes if n.startswith(each)) * random.uniform(-1.0, 1.0) for n in names]
    hand.set(**{n.replace(".", "__"): v + c for n, v, c in zip(names, values, changes, strict=True)})


def assert_exact(shown: Array, expected: Array) -> None:
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    assert np.all(np.abs(shown - expected) <= EXACT * scale)


CABLE_MOTION = {"position": 2e-3, "velocity": 0.5, "acceleration": 2.0, "winch_speed": 0.3, "winch_acceleration": 1.0}


def cable_outputs(slave: Cable, motion: Sequence[Any]) -> list[Any]:
    """Outputs without rates by the law on complex numbers; rates of the inputs do not count."""
    states = slave._state(slave.real[slave.states])
    inputs = cable_law.CableInputs(motion[0:3], motion[3:6], motion[9])
    span = cable_law.span(COMPLEX_STEP, slave.constants, inputs, slave.effects)
    moving = cable_law.cable_motion(COMPLEX_STEP, slave.constants, slave.effects, states, span, inputs.winch_speed)
    shown = cable_law.cable_outputs(COMPLEX_STEP, slave.constants, slave.effects, states, moving)
    return [*shown.force, shown.tension, shown.length, shown.elongation, shown.strain, shown.pull]


def cable_rates(slave: Cable, motion: Sequence[float]) -> Array:
    """Rates of force and tension by complex steps of the Python slave."""
    applied = AppliedMotion(motion[0:3], motion[3:6], motion[6:9], motion[9], motion[10])
    shown = slave._outputs_with_rates(slave.real[slave.states], applied, slave._span(applied))
    return np.array([value.imag / COMPLEX_STEP_SIZE for value in (*shown.force, shown.tension)])


def derivatives_of_cable(slave: Cable) -> Array:
    """Of the outputs by complex steps; of the rates, which are such, by central differences of the sixth order."""
    applied = slave._motion_at(slave.elapsed, 1.0, False)
    motion = np.array([*applied[0], *applied[1], *applied[2], *applied[3:]])
    columns = []
    for k in range(11):
        unit = np.eye(11)[k]
        values = cable_outputs(slave, list(motion + 1j * COMPLEX_STEP_SIZE * unit))
        differences = [
            cable_rates(slave, list(motion + j * 1e-3 * unit)) - cable_rates(slave, list(motion - j * 1e-3 * unit))
            for j in (1, 2, 3)
        ]
        rates = np.array([0.75, -0.15, 1.0 / 60.0]) @ np.array(differences) / 1e-3
        columns.append([*(complex(value).imag / COMPLEX_STEP_SIZE for value in values), *rates])
    return np.array(columns).T


@pytest.mark.validate(only=["several-set"])
@pytest.mark.parametrize("inputs_are_set", [True, False], ids=["set", "extrapolated"])
@pytest.mark.parametrize("name", ["plain", "several"])
def test_those_of_a_cable_are_those_of_its_law(
    name: str, inputs_are_set: bool, fmus_of: Callable[[str], RobotFmus]
) -> None:
    with in_hand(fmus_of(name).cables[1]) as cable:
        cable.run()
        shake(cable, CABLE_MOTION)
        cable.step(0.0, STEP)
        if inputs_are_set:
            shake(cable, CABLE_MOTION)
        assert cable.get("pull")[0] > 100.0
        data = cable_resources(DIFFERENTIATED[name])[1]
        slave = twin_of(cable, "cable", "Cable", data, 0.0 if inputs_are_set else STEP)
        shown, expected = cable.jacobian(), np.zeros((18, 22))
        expected[:12, MOTION] = derivatives_of_cable(slave)
        outputs = cable.names("output")
        assert outputs[8:12] == list(CABLE_RATES)
    assert_exact(shown, expected)
    assert np.count_nonzero(shown[:12]) > 50


def derivatives_of_platform(slave: Slave) -> Array:
    """By complex steps of the inputs; the law takes the forces as numbers of any kind."""
    outputs = [k for k, variable in enumerate(slave.variables) if variable.causality == "output"]
    columns = []
    for known in range(slave.input_count):
        values: list[Any] = list(slave.real)
        slave.real[known] = values[known] + 1j * COMPLEX_STEP_SIZE
        slave.refresh()
        columns.append([complex(slave.real[k]).imag / COMPLEX_STEP_SIZE for k in outputs])
        slave.real = values
    return np.array(columns).T


@pytest.mark.validate(but=["several"])
@pytest.mark.parametrize(
    ("name", "kind", "base"),
    [
        ("several", "point_mass", "PointMass"),
        ("delayed", "point_mass", "PointMass"),
        ("rigid", "rigid_body", "RigidBody"),
    ],
)
def test_those_of_a_platform_are_those_of_its_law(
    name: str, kind: str, base: str, fmus_of: Callable[[str], RobotFmus]
) -> None:
    with in_hand(fmus_of(name).platform) as platform:
        platform.run()
        shake(platform, {"force": 300.0, "external": 200.0})
        platform.step(0.0, STEP)
        shake(platform, {"force": 300.0, "external": 200.0})
        slave = twin_of(platform, kind, base, platform_resource(DIFFERENTIATED[name]), 0.0)
        shown, expected = platform.jacobian(), derivatives_of_platform(slave)
    assert_exact(shown, expected)
    assert np.count_nonzero(shown) > 10


@pytest.mark.parametrize("is_limited", [False, True], ids=["free", "limited"])
def test_those_of_a_winch_are_those_of_its_law(is_limited: bool, fmus_of: Callable[[str], RobotFmus]) -> None:
    path = fmus_of("several").winches[0]
    assert path is not None
    with in_hand(path) as winch:
        winch.set(speed_command=0.08)
        winch.run()
        winch.step(0.0, STEP)
        command = 0.6 if is_limited else winch.get("winch_speed")[0] + 0.005
        winch.set(speed_command=command)
        slave = twin_of(winch, "winch", "Winch", winch_resource(DIFFERENTIATED["several"], 1), 0.0)
        state = winch_drive.DriveState(*slave.real[slave.states])
        stepped = command + 1j * COMPLEX_STEP_SIZE
        values = [
            winch_drive.acceleration(COMPLEX_STEP, slave.constants, state, stepped),
            *winch_drive.limit_margins(COMPLEX_STEP, slave.constants, state, stepped),
        ]
        shown, expected = winch.jacobian(), np.zeros((6, 3))
    expected[1:5, 1] = [complex(value).imag / COMPLEX_STEP_SIZE for value in values]
    assert_exact(shown, expected)
    assert (shown[1, 1] == 0.0) == is_limited and np.any(shown[2:5])


@pytest.mark.parametrize("name", ["several", "rigid"])
def test_a_direction_is_the_product_with_the_jacobian(name: str, fmus_of: Callable[[str], RobotFmus]) -> None:
    random = np.random.default_rng(5)
    for path in fmus_of(name).paths[-1:] if name == "rigid" else fmus_of(name).paths:
        with in_hand(path) as hand:
            hand.run()
            unknowns, knowns = ([hand.references[n] for n in hand.names(each)] for each in ("output", "input"))
            seed = random.standard_normal(len(knowns))
            shown = hand.fmu.getDirectionalDerivative(unknowns[::-1], [*knowns, knowns[-1]], [*seed, 0.0])
            expected = hand.jacobian() @ seed
        assert np.allclose(shown[::-1], expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", ["plain", "several", "delayed", "rigid"])
def test_after_initialization_they_are_zero_where_the_model_structure_has_no_dependency(
    name: str, fmus_of: Callable[[str], RobotFmus]
) -> None:
    for path in fmus_of(name).paths:
        with in_hand(path) as hand:
            hand.run()
            inputs, outputs = hand.names("input"), hand.names("output")
            depends = {u.variable.name: {k.name for k in u.dependencies or []} for u in hand.description.outputs}
            for time in (0.0, STEP):
                shown = {(outputs[row], inputs[column]) for row, column in np.argwhere(hand.jacobian())}
                assert all(known in depends[unknown] for unknown, known in shown)
                hand.step(time, STEP)


def test_in_initialization_the_middle_of_a_step_is_the_start(fmus_of: Callable[[str], RobotFmus]) -> None:
    fmus = fmus_of("several")
    for path, values in ((fmus.cables[0], "force_rate.z"), (fmus.platform, "acceleration.z")):
        with in_hand(path) as hand:
            outputs = hand.names("output")
            row, middle_row = (outputs.index(name) for name in (values, f"middle_{values}"))
            shown = hand.jacobian()
            assert np.any(shown[row]) and np.array_equal(shown[row], shown[middle_row])
            hand.run()
            assert np.array_equal(hand.jacobian()[row], shown[row]) and not np.any(hand.jacobian()[middle_row])


def test_a_load_cell_that_lags_shows_no_inputs_of_now(fmus_of: Callable[[str], RobotFmus]) -> None:
    with in_hand(fmus_of("delayed").cables[0]) as cable:
        cable.run()
        rows = [cable.names("output").index(name) for name in ("tension", "tension_rate", "pull")]
        assert np.all(np.any(cable.jacobian()[rows], axis=1))
        cable.step(0.0, STEP)
        assert np.any(cable.jacobian()[rows], axis=1).tolist() == [False, False, True]


def test_those_of_a_sampled_controller_are_zero(tmp_path: Path) -> None:
    path = build_native_controller_fmu(DIFFERENTIATED["plain"], Feedforward(3), PATH, 2.5, tmp_path)
    with in_hand(path) as controller:
        controller.run()
        controller.step(0.0, STEP)
        shown = controller.jacobian()
    assert shown.size and not np.any(shown)
