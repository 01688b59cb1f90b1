"""The slaves through FMI: they are the laws, remember everything, and are good to any master."""

import gc
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tautwire.fmus.component import Component, ComponentError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.cable_routes import unit_directions
from tautwire.robot.kinematics import inverse_kinematics, structure_matrix
from tautwire.robot.robot_assembly import assemble_robot
from tautwire.robot.schema import EffectSetting
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.symbolic_equations import CASADI_MATHEMATICS
from tests.support.fmus import Hand, in_hand
from tests.support.robots import paper_robot

FATAL = 4

MOTION = {"position__z": 5.1, "velocity__x": 0.2, "velocity__z": -0.3, "winch_speed": 0.4}
SHOWN = ("tension", "force.x", "force.y", "force.z", "force_rate.x", "tension_rate", "length", "strain", "elongation")


@pytest.fixture(scope="module")
def payload_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    robot = paper_robot().with_effect(EffectSetting("payload", {"mass": 12.0}))
    return build_fmus(robot, tmp_path_factory.mktemp("payload"))


def test_a_cable_shows_the_law(damped_fmus: RobotFmus) -> None:
    with in_hand(damped_fmus.cables[0]) as cable:
        cable.set(**MOTION)
        tension, length = cable.get("tension", "length")
    anchors = np.array([[0.0, 50.0, 50.0], [0.0, -50.0, 50.0], [86.6, 0.0, 50.0]])
    spans = anchors - [28.86, 0.0, 5.0]
    lengths = np.linalg.norm(spans, axis=1)
    start_tension = np.linalg.solve((spans / lengths[:, None]).T, [0.0, 0.0, 300.0 * 9.8])[0]
    span = anchors[0] - [28.86, 0.0, 5.1]
    now = np.linalg.norm(span)
    rate = -span @ [0.2, 0.0, -0.3] / now
    stress = 134.8e9 * np.log(now / lengths[0]) + 2.08e9 * (rate + 0.4) / now
    assert length == pytest.approx(now, rel=1e-15)
    assert tension == pytest.approx(np.pi * 0.002**2 * stress + start_tension, rel=1e-12)


def test_a_rope_swivels_about_the_declared_axis(tmp_path: Path) -> None:
    robot = paper_robot().with_effect(EffectSetting("pulley", {"radius": 0.4}, (1, 2, 3)))
    tilted = replace(robot, cables=tuple(replace(cable, swivel_axis=(0.6, 0.0, 0.8)) for cable in robot.cables))
    lengths, start = inverse_kinematics(tilted), tilted.platform.start
    with in_hand(build_fmus(tilted, tmp_path).cables[0]) as cable:
        assert cable.get("length") == pytest.approx([lengths[0]], rel=1e-14)
    assert abs(lengths[0] - inverse_kinematics(robot)[0]) > 0.01
    symbolic = assemble_robot(tilted, list(static_tensions(tilted)), CASADI_MATHEMATICS)
    assert [float(each.constants.start_length) for each in symbolic.cables] == pytest.approx(lengths, rel=1e-14)
    assert unit_directions(tilted) == pytest.approx(structure_matrix(tilted, start))


def test_rates_are_the_derivatives_of_the_outputs(damped_fmus: RobotFmus) -> None:
    with in_hand(damped_fmus.cables[0]) as cable:
        cable.set(**MOTION, acceleration__z=0.7, winch_acceleration=-0.2)
        cable.run()
        rates = cable.get("tension_rate", "force_rate.x")
        before = cable.get("tension", "force.x")
        cable.step(0.0, 1e-5)
        after = cable.get("tension", "force.x")
    assert rates == pytest.approx([(b - a) / 1e-5 for a, b in zip(before, after, strict=True)], rel=1e-4)


def test_a_falling_platform_follows_the_parabola(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.platform) as platform:
        free = {f"force_{i}__{axis}": 0.0 for i in (1, 2, 3) for axis in "xyz"}
        platform.set(**free)
        assert platform.get("acceleration.z") == [-9.8]
        platform.run()
        platform.step(0.0, 0.5)
        assert platform.get("velocity.z", "position.z") == pytest.approx([-4.9, 5.0 - 0.5 * 9.8 * 0.25], rel=1e-15)


def test_inputs_are_extrapolated_by_their_rates(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.platform) as platform:
        platform.set(force_1__x=0.0, force_2__x=0.0, force_3__x=0.0, force_rate_1__x=600.0)
        platform.run()
        platform.step(0.0, 0.1)
        assert platform.get("velocity.x", "acceleration.x") == pytest.approx([0.01, 0.2], rel=1e-12)


def test_a_parameter_set_after_a_step_leaves_the_inputs_extrapolated(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.platform) as platform:
        platform.set(force_1__x=0.0, force_2__x=0.0, force_3__x=0.0, force_rate_1__x=600.0)
        platform.run()
        platform.step(0.0, 0.1)
        platform.set(mass=150.0)
        assert platform.get("acceleration.x") == pytest.approx([0.4], rel=1e-12)
        platform.set(force_rate_1__x=600.0)
        assert platform.get("acceleration.x") == [0.0]


def test_stamped_inputs_run_on_the_cubic_through_both_ends(three_fmus: RobotFmus) -> None:
    force = np.polynomial.Polynomial([30.0, -200.0, 5000.0, 9000.0])
    acceleration = force / 300.0
    rate = force.deriv()
    with in_hand(three_fmus.platform) as platform:
        platform.set(force_1__x=force(0.0), force_2__x=0.0, force_3__x=0.0, force_rate_1__x=rate(0.0))
        platform.run()
        platform.set(input_time=0.1)
        platform.set(force_1__x=force(0.1), force_rate_1__x=rate(0.1))
        platform.step(0.0, 0.1)
        velocity, position = platform.get("velocity.x", "position.x")
    assert velocity == pytest.approx(acceleration.integ()(0.1), rel=1e-13)
    assert position - 28.86 == pytest.approx(acceleration.integ(2)(0.1), rel=1e-9)


def test_inputs_may_be_set_all_at_once_in_any_order_or_one_by_one(damped_fmus: RobotFmus) -> None:
    generator, shown = np.random.default_rng(2), []
    for way in ("one by one", "in order", "in another order"):
        values = np.random.default_rng(3)
        with in_hand(damped_fmus.cables[1]) as cable:
            inputs = [v.name for v in cable.description.modelVariables if v.causality == "input"]
            start = dict(zip(inputs, cable.get(*inputs), strict=True))
            cable.run()
            for k in range(1, 4):
                now = {n: v + 0.01 * values.normal() for n, v in start.items()} | {"input_time": 0.1 * k}
                now |= {"middle_time": 0.1 * k - 0.05}
                order = generator.permutation(inputs).tolist() if way == "in another order" else inputs
                groups = [[name] for name in inputs] if way == "one by one" else [order]
                for group in groups:
                    cable.set(**{name.replace(".", "__"): now[name] for name in group})
                cable.step(0.1 * (k - 1), 0.1)
            shown.append(cable.get(*SHOWN, "unstrained_length"))
    assert shown[0] == shown[1] == shown[2]


def shown_after_steps(cable: Hand) -> list[float]:
    for k in range(3):
        cable.set(position__z=5.0 + 0.01 * k, winch_speed=0.1 * k)
        cable.step(0.1 + 0.01 * k, 0.01)
    return cable.get(*SHOWN, "unstrained_length")


def test_a_rollback_gives_the_same_bits(damped_fmus: RobotFmus) -> None:
    with in_hand(damped_fmus.cables[2]) as cable:
        cable.set(**MOTION)
        cable.run()
        cable.step(0.0, 0.1)
        saved = cable.fmu.getFMUstate()
        first = shown_after_steps(cable)
        cable.fmu.setFMUstate(saved)
        assert shown_after_steps(cable) == first
        cable.fmu.freeFMUstate(saved)


def test_a_serialised_state_goes_on_in_another_instance(damped_fmus: RobotFmus) -> None:
    with in_hand(damped_fmus.cables[2]) as cable:
        cable.set(**MOTION, modulus=1.1e11)
        cable.run()
        cable.step(0.0, 0.1)
        state = cable.fmu.getFMUstate()
        content = cable.fmu.serializeFMUstate(state)
        expected = shown_after_steps(cable)
    with in_hand(damped_fmus.cables[2]) as other:
        other.run()
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(content))
        assert shown_after_steps(other) == expected


def test_parameters_move_the_start_before_the_first_step(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.cables[0]) as cable:
        cable.set(anchor__z=60.0, start_tension=2000.0)
        length, unstrained, tension = cable.get("length", "unstrained_length", "tension")
    assert length == unstrained == pytest.approx(np.sqrt(28.86**2 + 50.0**2 + 55.0**2), rel=1e-15)
    assert tension == 2000.0


@pytest.mark.parametrize("step", [0.0, -0.01, float("nan")])
def test_an_impossible_step_is_refused_and_changes_nothing(three_fmus: RobotFmus, step: float) -> None:
    with in_hand(three_fmus.platform) as platform:
        platform.run()
        before = platform.get("position.x", "velocity.z")
        with pytest.raises(FMICallException):
            platform.step(0.0, step)
        assert platform.get("position.x", "velocity.z") == before


def test_an_impossible_input_does_not_bring_the_process_down(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.cables[0]) as cable:
        cable.run()
        cable.set(position__x=0.0, position__y=50.0, position__z=50.0)
        for _ in range(5):
            with pytest.raises(FMICallException):
                cable.step(0.0, 0.01)
        cable.set(position__x=28.86, position__y=0.0, position__z=5.0)
        cable.step(0.0, 0.01)
        assert cable.get("length") == pytest.approx([73.1977], abs=1e-4)


def test_unknown_references_spoil_the_instance_but_not_the_process(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.cables[0]) as cable:
        cable.run()
        for _ in range(5):
            assert np.isnan(cable.fmu.getReal([9999])[0])
            cable.fmu.setReal([9999], [1.0])
        with pytest.raises(FMICallException):
            cable.step(0.0, 0.01)


@pytest.mark.parametrize("content", [b"", b"no state", b"[[1.0], null, 0.0, true]", b'{"a": 1}'])
def test_bytes_that_are_no_state_are_refused_at_the_next_step(three_fmus: RobotFmus, content: bytes) -> None:
    with in_hand(three_fmus.platform) as platform:
        platform.run()
        saved = platform.fmu.getFMUstate()
        for _ in range(4):
            platform.fmu.setFMUstate(platform.fmu.deSerializeFMUstate(content))
        with pytest.raises(FMICallException):
            platform.step(0.0, 0.01)
        platform.fmu.setFMUstate(saved)
        platform.step(0.0, 0.01)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_inputs_that_are_not_finite_end_the_step_with_an_error_and_change_nothing(
    three_fmus: RobotFmus, value: float
) -> None:
    with in_hand(three_fmus.cables[0]) as cable, in_hand(three_fmus.platform) as platform:
        cable.run()
        platform.run()
        cable.set(winch_acceleration=value)
        platform.set(force_1__x=value)
        for hand, state in ((cable, "unstrained_length"), (platform, "position.x")):
            before = hand.get(state)
            for _ in range(4):
                with pytest.raises(FMICallException) as caught:
                    hand.step(0.0, 0.01)
                assert caught.value.status == FATAL
            assert hand.get(state) == before
        cable.set(winch_acceleration=0.0)
        cable.step(0.0, 0.01)


def test_inputs_that_are_not_finite_are_named_as_initialisation_ends(three_fmus: RobotFmus) -> None:
    with Component("cable", three_fmus.cables[0]) as cable:
        cable.initialize(0.0, {})
        block = cable.block(["velocity.x", "winch_speed"])
        block.values[:] = 0.0, np.nan
        cable.write(block)
        with pytest.raises(ComponentError, match=r"ExitInitializationMode.*at 0.0 s winch_speed is nan: inputs"):
            cable.run()


def test_finite_inputs_whose_sum_is_not_are_no_error(three_fmus: RobotFmus) -> None:
    with in_hand(three_fmus.platform) as platform:
        platform.run()
        platform.set(force_1__x=1.5e308, force_2__x=-1.5e308, force_1__y=1.5e308, force_2__y=-1.5e308, input_time=1e308)
        platform.step(0.0, 0.01)


@pytest.mark.parametrize(
    ("component", "name", "value", "problem"),
    [
        ("platform", "mass", -3.0, r"mass is -3.0 kg, it has to be at least 0.0 kg"),
        ("platform", "gravity", float("nan"), r"gravity is nan m/s2, it has to be finite"),
        ("platform", "effect.payload.mass", 2e6, r"has to be at least -1000000.0 and at most 1000000.0 kg"),
        ("cable_1", "modulus", -1.0, r"modulus is -1.0 Pa, it has to be at least 0.0 Pa"),
    ],
)
def test_parameters_outside_their_bounds_are_refused(
    payload_fmus: RobotFmus, component: str, name: str, value: float, problem: str
) -> None:
    with Component(component, payload_fmus.by_component[component]) as instance:
        with pytest.raises(ComponentError, match=f"fmi2SetReal gave 'fatal'.*{problem}"):
            instance.initialize(0.0, {name: value})
        block = instance.block([name])
        instance.read(block)
        assert block.values[0] == float(instance.variables[name].start)


@pytest.mark.validate
def test_refused_parameters_leave_the_process_alive(three_fmus: RobotFmus) -> None:
    for _ in range(5):
        with in_hand(three_fmus.platform) as platform:
            for _ in range(3):
                with pytest.raises(FMICallException):
                    platform.set(mass=-3.0)
        gc.collect()
    rows = fmpy.simulate_fmu(str(three_fmus.platform), stop_time=0.1, output=["position.z"])
    assert rows["position.z"][-1] == pytest.approx(5.0, abs=1e-12)
