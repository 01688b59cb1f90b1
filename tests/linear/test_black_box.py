"""Wired FMUs linearised from outside, against the exact plant of the laws and against systems solved by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.cosimulation import Component, Connection, CouplingGraph, Port, Wiring, build_coupling_graph
from tautwire.errors import InputError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.linear import (
    BlackBoxPlant,
    IdentificationError,
    PlantSignals,
    black_box,
    linearise,
    linearise_fmus,
    linearise_robot_fmus,
)
from tautwire.linear.pulse_experiments import PulseExperiment
from tautwire.robot.schema import EffectSetting, Robot, UserFmu, Winch
from tests.support.effect_cases import CASES, UNLISTED_CASES, Case
from tests.support.effects import with_effects
from tests.support.model_descriptions import with_descriptions
from tests.support.own_fmus import LAG, compiler, falling_mass, lag_winch
from tests.support.rigid_robots import octahedral_robot
from tests.support.robots import NAMES, example, paper_robot, with_winch

Array = NDArray[np.float64]

AGREES = 1e-5
needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def distances(found: BlackBoxPlant, exact: Any) -> dict[str, float]:
    """Relative distance of each matrix in the norm of ``linearise_fmus``: largest deviations are the units.

    Of one that is zero, as D behind load cells with a low-pass filter, the distance in these units.
    """
    states, inputs = found.state_amplitudes, found.input_amplitudes
    outputs = np.abs(exact.C) @ states
    scales = {"A": (states, states), "B": (states, inputs), "C": (outputs, states), "D": (outputs, inputs)}
    return {
        name: float(
            np.linalg.norm((getattr(found.system, name) - getattr(exact, name)) * columns / rows[:, None])
            / (np.linalg.norm(getattr(exact, name) * columns / rows[:, None]) or 1.0)
        )
        for name, (rows, columns) in scales.items()
    }


def swings(system: Any) -> NDArray[np.complex128]:
    """The eigenvalues of its oscillations."""
    poles = system.poles()
    return np.array(sorted(poles[poles.imag > 1.0], key=lambda pole: pole.imag))


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", NAMES)
def test_it_is_the_plant_of_the_laws(name: str, tmp_path: Path) -> None:
    robot = example(name)
    exact = linearise(robot).system
    plant = linearise_robot_fmus(build_fmus(robot, tmp_path))
    assert plant.system.state_labels == exact.state_labels
    assert plant.system.input_labels == exact.input_labels
    assert plant.system.output_labels == exact.output_labels
    assert max(distances(plant, exact).values()) < AGREES
    assert swings(plant.system) == pytest.approx(swings(exact), rel=AGREES)
    assert plant.error < 1e-6 and plant.notes == ()


@pytest.mark.validate
def test_rigid_platforms_are_the_plant_of_the_laws(tmp_path: Path) -> None:
    """At the step by default six stiff ropes, which vibrate at 42 Hz, do not converge."""
    exact = linearise(octahedral_robot()).system
    found = linearise_robot_fmus(build_fmus(octahedral_robot(), tmp_path, native=True), step=0.004)
    names = [[f"{name}_{axis}" for axis in "xyz"] for name in ("external_force", "external_moment", "angular_velocity")]
    assert found.system.input_labels[-6:] == [*names[0], *names[1]]
    assert set(names[2]) < set(found.system.output_labels)
    rows = [exact.output_labels.index(label) for label in found.system.output_labels]
    frequencies = 2j * np.pi * np.linspace(3.0, 50.0, 7)
    gains, expected = found.system(frequencies), exact(frequencies)[rows]
    assert np.max(np.abs(gains - expected) / np.max(np.abs(expected), axis=(0, 1))) < AGREES
    assert swings(found.system) == pytest.approx(swings(exact), rel=AGREES)


@pytest.mark.validate
def test_fmus_that_take_steps_of_one_length_only_get_no_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: dict[Component, set[float]] = {}
    take_step = Component.step

    def noted_step(component: Component, time: float, step: float) -> None:
        steps.setdefault(component, set()).add(round(step, 12))
        take_step(component, time, step)

    monkeypatch.setattr(Component, "step", noted_step)
    fmus = build_fmus(example("three"), tmp_path, native=True)
    flexible = 'canHandleVariableCommunicationStepSize="true"'
    (changed := tmp_path / "changed").mkdir()
    plant = linearise_robot_fmus(with_descriptions(fmus, changed, {flexible: flexible.replace("true", "false")}))
    assert len(set.union(*steps.values())) > 1
    assert max(map(len, steps.values())) == 1
    assert max(distances(plant, linearise(example("three")).system).values()) < AGREES


@pytest.mark.validate
def test_pulses_are_of_the_nominal_value_that_a_declared_type_states(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class PreparedError(Exception):
        pass

    def prepare(*arguments: Any) -> None:
        with ExitStack() as stack:
            raise PreparedError(PulseExperiment(stack, *arguments).nominal.tolist())

    monkeypatch.setattr(black_box, "pulse_experiment", prepare)
    types = '<TypeDefinitions><SimpleType name="Speed"><Real unit="m/s" nominal="0.25"/></SimpleType></TypeDefinitions>'
    changes = {
        '<Real start="0.0" unit="m/s"/>': '<Real declaredType="Speed" start="0.0"/>',
        "<LogCategories>": f"{types}<LogCategories>",
    }
    (changed := tmp_path / "changed").mkdir()
    with pytest.raises(PreparedError) as prepared:
        linearise_robot_fmus(with_descriptions(build_fmus(example("three"), tmp_path), changed, changes))
    assert prepared.value.args[0][:3] == [0.25] * 3


def smooth(case: Case) -> bool:
    """Whether an effect has a linear plant without dead time, near enough to compare."""
    return case.name != "hysteresis" and not {"slip", "tension_delay", "position_delay"} & set(case.law)


FIRST_FORMS = {case.name: case for case in reversed((*CASES, *UNLISTED_CASES)) if smooth(case)}.values()


@pytest.mark.validate
@pytest.mark.parametrize("case", FIRST_FORMS, ids=str)
def test_it_is_the_plant_of_the_laws_with_each_effect(case: Case, tmp_path: Path) -> None:
    robot = with_effects(paper_robot(damping=4e8), case)
    exact = linearise(robot).system
    # FMUs also show branches of relaxation that are not in use.
    plant = linearise_robot_fmus(build_fmus(robot, tmp_path, native=True), states=exact.state_labels)
    assert plant.system.state_labels == exact.state_labels
    assert max(distances(plant, exact).values()) < AGREES


@pytest.mark.validate
def test_effects_are_found_with_their_states(tmp_path: Path) -> None:
    robot = paper_robot(damping=4e8)
    effects = {
        "relaxation": {"modulus": 3e10, "time": 0.5, "modulus_2": 1e10, "time_2": 5.0},
        "sag": {"linear_density": 0.1},
        "pulley": {"radius": 0.15},
        "sensor_gain": {"tension_gain": 1.02, "position_gain": 1.001},
    }
    for name, values in effects.items():
        robot = robot.with_effect(EffectSetting(name, values, robot.cable_numbers))
    exact = linearise(robot).system
    plant = linearise_robot_fmus(build_fmus(robot, tmp_path, native=True), states=exact.state_labels)
    assert plant.system.state_labels == exact.state_labels
    assert max(distances(plant, exact).values()) < AGREES


@pytest.mark.validate
def test_states_that_are_not_named_are_found(damped_fmus: RobotFmus) -> None:
    exact = linearise(paper_robot(damping=2.08e9)).system
    plant = linearise_robot_fmus(damped_fmus, states=()).system
    assert plant.state_labels == [f"x_{k}" for k in range(1, 10)]
    frequencies = 2j * np.pi * np.geomspace(0.1, 10.0, 20)
    response, expected = plant(frequencies), exact(frequencies)
    largest = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert np.max(np.abs(response - expected) / largest) < AGREES
    assert swings(plant) == pytest.approx(swings(exact), rel=AGREES)


@pytest.mark.validate
def test_winches_add_their_speed_loops(tmp_path: Path) -> None:
    winch = Winch(drum_radius=0.2, bandwidth=8.0, damping_ratio=0.7)
    plain = paper_robot(damping=2.08e9)
    plant = linearise_robot_fmus(build_fmus(with_winch(plain, winch), tmp_path)).system
    assert plant.input_labels[:3] == ["speed_command_1", "speed_command_2", "speed_command_3"]
    assert plant.nstates == 15
    # A PI loop on an integrator: (2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2).
    s, w = 2j * np.pi * np.geomspace(0.2, 20.0, 15), 2.0 * np.pi * 8.0
    loop = (1.4 * w * s + w**2) / (s**2 + 1.4 * w * s + w**2)
    exact = linearise(plain).system
    for output in ("position_x", "tension_1"):
        expected = exact[output, "winch_speed_1"](s) * loop
        assert plant[output, "speed_command_1"](s) == pytest.approx(expected, rel=1e-4)
    assert plant["winch_speed_1", "speed_command_1"](s) == pytest.approx(loop, rel=1e-5)


def own_robot(robot: Robot, slot: str, path: Path, folder: Path) -> RobotFmus:
    return build_fmus(replace(robot, fmus=(UserFmu(slot, path),)), folder)


@pytest.mark.validate
@needs_compiler
def test_a_robot_with_a_users_winch(tmp_path: Path) -> None:
    robot = paper_robot(damping=2.08e9)
    plant = linearise_robot_fmus(own_robot(robot, "winch_1", lag_winch(tmp_path), tmp_path / "built"))
    exact = linearise(robot).system
    s = 2j * np.pi * np.geomspace(0.3, 5.0, 9)
    for output in ("position_x", "tension_1"):
        expected = exact[output, "winch_speed_1"](s) / (1.0 + LAG * s)
        assert plant.system[output, "speed_command_1"](s) == pytest.approx(expected, rel=AGREES)
    assert swings(plant.system) == pytest.approx(swings(exact), rel=AGREES)


@pytest.mark.validate
def test_a_robot_with_a_users_platform_that_cannot_save_its_state(tmp_path: Path) -> None:
    robot = paper_robot(damping=2.08e9)
    plant = linearise_robot_fmus(own_robot(robot, "platform", falling_mass(tmp_path), tmp_path / "built"))
    exact = linearise(robot).system
    assert plant.system.input_labels == ["winch_speed_1", "winch_speed_2", "winch_speed_3"]
    assert swings(plant.system) == pytest.approx(swings(exact), rel=AGREES)
    s = 2j * np.pi * np.geomspace(0.3, 5.0, 9)
    for output in ("position_x", "tension_1"):
        expected = exact[output, "winch_speed_1"](s)
        assert plant.system[output, "winch_speed_1"](s) == pytest.approx(expected, rel=AGREES)


@contextmanager
def wired(
    parts: dict[str, Path], connections: Sequence[Connection], drives: Sequence[Port], **start: float
) -> Iterator[CouplingGraph]:
    with ExitStack() as stack:
        components = {name: stack.enter_context(Component(name, path)) for name, path in parts.items()}
        for component in components.values():
            component.initialize(0.0, start)
        yield build_coupling_graph(components, Wiring(connections=tuple(connections), external_inputs=tuple(drives)))


@needs_compiler
def test_a_chain_of_a_users_fmus_that_is_no_robot(tmp_path: Path) -> None:
    path = lag_winch(tmp_path)
    command, speed = Port("first", "speed_command"), Port("second", "winch_speed")
    chain = [Connection(Port("first", "winch_speed"), Port("second", "speed_command"))]
    make = partial(wired, {"first": path, "second": path}, chain, [command], lag=0.1)
    plant = linearise_fmus(make, PlantSignals({"command": command}, {"speed": speed}))
    assert plant.system.nstates == 2
    assert plant.system.poles().real == pytest.approx([-10.0, -10.0], rel=1e-3)
    s = 1j * np.geomspace(0.1, 100.0, 10)
    assert plant.system(s) == pytest.approx(1.0 / (1.0 + 0.1 * s) ** 2, rel=1e-4)


@needs_compiler
def test_states_may_be_named_in_any_system(tmp_path: Path) -> None:
    make, command = one_winch(tmp_path)
    speed = Port("winch", "winch_speed")
    system = linearise_fmus(make, PlantSignals({"c": command}, {"v": speed}, {"v": speed})).system
    assert system.state_labels == ["v"]
    assert system.A[0, 0] == pytest.approx(-1.0 / LAG, rel=AGREES)
    assert system.B[0, 0] == pytest.approx(1.0 / LAG, rel=AGREES)
    assert system.C[0, 0] == pytest.approx(1.0) and system.D[0, 0] == pytest.approx(0.0, abs=1e-9)


def one_winch(folder: Path) -> tuple[Callable[..., Any], Port]:
    command = Port("winch", "speed_command")
    return partial(wired, {"winch": lag_winch(folder)}, [], [command]), command


@needs_compiler
def test_a_start_that_is_not_at_rest_is_refused(tmp_path: Path) -> None:
    make, command = one_winch(tmp_path)
    speed = Port("winch", "winch_speed")
    with pytest.raises(IdentificationError, match=r"not at rest, winch\.winch_speed moves by"):
        linearise_fmus(make, PlantSignals({"c": command}, {"v": speed}), rest_inputs={command: 1.0})


@needs_compiler
def test_a_port_that_the_master_does_not_drive_is_refused(tmp_path: Path) -> None:
    make, _ = one_winch(tmp_path)
    speed = Port("winch", "winch_speed")
    with pytest.raises(IdentificationError, match=r"winch\.winch_speed is not an external input"):
        linearise_fmus(make, PlantSignals({"v": speed}, {"v": speed}))


@pytest.mark.validate
def test_states_that_do_not_tell_all_are_refused(damped_fmus: RobotFmus) -> None:
    with pytest.raises(IdentificationError, match=r"name all states, or none|short enough"):
        linearise_robot_fmus(damped_fmus, states=["position_x", "velocity_x"])


def test_an_unknown_state_is_refused(damped_fmus: RobotFmus) -> None:
    with pytest.raises(InputError, match="no FMU outputs a state 'speed'; choose among position_x"):
        linearise_robot_fmus(damped_fmus, states=["speed"])


@pytest.mark.validate
def test_dead_time_is_refused(tmp_path: Path) -> None:
    robot = paper_robot(damping=4e8).with_effect(EffectSetting("sensor_delay", {"position_delay": 0.05}, (1, 2, 3)))
    with pytest.raises(IdentificationError):
        linearise_robot_fmus(build_fmus(robot, tmp_path, native=True))


@pytest.mark.validate
def test_drift_is_noted(tmp_path: Path) -> None:
    setting = EffectSetting("thermal", {"rise": 10.0, "time": 20.0, "expansion": 1.2e-5}, (1, 2, 3))
    robot = paper_robot(damping=4e8).with_effect(setting)
    plant = linearise_robot_fmus(build_fmus(robot, tmp_path, native=True))
    assert len(plant.notes) == 1 and plant.notes[0].startswith("not quite at rest: platform.velocity.z")
    assert max(distances(plant, linearise(robot).system).values()) < AGREES


def slipping(slip: float) -> Robot:
    """A drum on which rope slips by a share of the speed, whichever way it turns."""
    robot = paper_robot(damping=4e8)
    return robot.with_effect(EffectSetting("drum", {"slip": slip}, (1,)))


@pytest.mark.validate
def test_a_small_slope_change_at_rest_is_reported(tmp_path: Path) -> None:
    notes = linearise_robot_fmus(build_fmus(slipping(2e-5), tmp_path, native=True)).notes
    assert len(notes) == 1
    assert notes[0].startswith("nonsmooth at rest: responses to pulses of winch_speed_1 up and down differ by 3%")


@pytest.mark.validate
def test_a_large_slope_change_at_rest_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        IdentificationError, match=r"nonsmooth at rest: .* cable_1\.winch_speed up and down differ by 32%"
    ):
        linearise_robot_fmus(build_fmus(slipping(2e-4), tmp_path, native=True))
