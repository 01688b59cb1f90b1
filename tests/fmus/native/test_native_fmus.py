"""Native FMUs beside those of Python: the same variables, the same numbers, the same refusals."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tests.support.effect_cases import CASES, PAIRS, UNLISTED_CASES, Case, same
from tests.support.effects import with_effects
from tests.support.fmus import Hand, in_hand
from tests.support.native import both_kinds, both_runs, largest_difference
from tests.support.robots import LIMITED, example, gentle_speeds, paper_robot, with_winch

SAME = 1e-10
# Of a rope that sticks and slips: rounding moves the instant at which it does, by a processor's own arithmetic.
SAME_WITH_FRICTION = 1e-8
DELAYED = same("sensor_delay", tension_delay=0.023)
FMI_DISCARD, FMI_ERROR = 2, 3
LAST_SUCCESSFUL_TIME, TERMINATED = 2, 3  # kinds of fmi2StatusKind


@pytest.fixture(scope="module")
def complete_fmus(tmp_path_factory: pytest.TempPathFactory) -> tuple[RobotFmus, RobotFmus]:
    """A robot on winches with every effect, of Python and native."""
    robot = with_winch(with_effects(example("three"), *CASES), LIMITED)
    return both_kinds(robot, tmp_path_factory.mktemp("complete"))


@pytest.fixture(scope="module")
def plain_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's robot, native."""
    return build_fmus(paper_robot(), tmp_path_factory.mktemp("plain"), native=True)


def described_variables(description: ModelDescription) -> list[tuple[object, ...]]:
    """All but those of model exchange."""
    return [
        (v.name, v.valueReference, v.causality, v.variability, v.initial, v.start, v.unit, v.min, v.max, v.nominal)
        for v in description.modelVariables
        if not v.name.startswith(("der(", "event_indicator_"))
    ]


def dependencies(description: ModelDescription) -> list[tuple[str, list[str]]]:
    """Inputs on which each output depends."""
    return [
        (u.variable.name, [known.name for known in u.dependencies or [] if known.causality == "input"])
        for u in description.outputs
    ]


def test_variables_are_those_of_the_python_fmus(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    for python, native in zip(complete_fmus[0].paths, complete_fmus[1].paths, strict=True):
        one, other = (fmpy.read_model_description(str(path)) for path in (python, native))
        assert described_variables(one) == described_variables(other)
        for (name, inputs), (native_name, of_native) in zip(dependencies(one), dependencies(other), strict=True):
            assert name == native_name
            # In model exchange a lagging sensor shows the present, too, in steps longer than its lag.
            is_late = name == "tension" or name.startswith("measured_position")
            assert set(inputs) < set(of_native) if is_late else inputs == of_native
        assert not other.coSimulation.needsExecutionTool


@pytest.mark.validate
def test_nothing_is_wrong_with_native_fmus(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    assert [validate_fmu(str(path)) for path in complete_fmus[1].paths] == [[]] * 7


@pytest.mark.validate
def test_all_effects_together_run_as_in_python(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    time, speed = gentle_speeds(example("three"), 0.5, 0.02)
    python, native = (cosimulate(fmus, time, speed) for fmus in complete_fmus)
    assert largest_difference(python, native) < SAME


@pytest.mark.validate
@pytest.mark.parametrize(
    "cases", [*((case,) for case in (*CASES, *UNLISTED_CASES)), *PAIRS], ids=lambda cases: "+".join(map(str, cases))
)
def test_each_effect_runs_as_in_python(cases: tuple[Case, ...], tmp_path: Path) -> None:
    time, speed = gentle_speeds(example("three"), 1.0, 0.02)
    python, native = both_runs(with_effects(example("three"), *cases), tmp_path, time, speed)
    has_friction = any(case.name == "friction" for case in cases)
    assert largest_difference(python, native) < (SAME_WITH_FRICTION if has_friction else SAME)


def go_on(cable: Hand) -> list[float]:
    shown = []
    for k in range(4):
        cable.set(input_time=0.03 + 0.01 * k, position__z=5.0 + 0.01 * k, winch_speed=0.1 * k)
        cable.step(0.02 + 0.01 * k, 0.01)
        shown += cable.get("tension", "tension_rate", "middle_force.x", "unstrained_length")
    return shown


def begin(cable: Hand) -> None:
    cable.set(winch_speed=0.3)
    cable.run()
    cable.step(0.0, 0.01)
    cable.step(0.01, 0.01)


def test_saved_and_serialised_states_go_on_with_the_same_bits(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    with in_hand(complete_fmus[1].cables[2]) as cable:
        begin(cable)
        saved = cable.fmu.getFMUstate()
        content = cable.fmu.serializeFMUstate(saved)
        first = go_on(cable)
        cable.fmu.setFMUstate(saved)
        assert go_on(cable) == first
        cable.fmu.freeFMUstate(saved)
    with in_hand(complete_fmus[1].cables[2]) as other:
        other.run()
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(content))
        assert go_on(other) == first
    assert first[0] != first[4]


@pytest.mark.parametrize("damage", ["shorter", "longer", "changed", "of another model"])
def test_serialised_states_that_are_damaged_are_refused(
    damage: str, complete_fmus: tuple[RobotFmus, RobotFmus], plain_fmus: RobotFmus
) -> None:
    with in_hand(complete_fmus[1].cables[2]) as cable, in_hand(plain_fmus.cables[0]) as plain:
        begin(cable)
        begin(plain)
        content = cable.fmu.serializeFMUstate(cable.fmu.getFMUstate())
        changed = content[:100] + bytes([content[100] ^ 1]) + content[101:]
        other = plain.fmu.serializeFMUstate(plain.fmu.getFMUstate())
        damaged = {"shorter": content[:-8], "longer": content + content[-48:], "changed": changed}.get(damage, other)
        with pytest.raises(FMICallException) as caught:
            cable.fmu.deSerializeFMUstate(damaged)
        assert caught.value.status == FMI_ERROR


def test_a_rope_reeled_in_past_its_end_discards_the_step_and_keeps_the_state(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        cable.run()
        before = cable.get("tension", "unstrained_length", "wound_length")
        cable.set(winch_speed=1e6)
        with pytest.raises(FMICallException) as caught:
            cable.step(0.0, 0.01)
        assert caught.value.status == FMI_DISCARD
        cable.set(winch_speed=0.0)
        assert cable.get("tension", "unstrained_length", "wound_length") == before


def test_calls_are_allowed_in_their_states_only(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        for call in (lambda: cable.step(0.0, 0.01), cable.fmu.terminate, cable.fmu.enterInitializationMode):
            with pytest.raises(FMICallException):
                call()
        cable.run()
        with pytest.raises(FMICallException):
            cable.run()
        cable.step(0.0, 0.01)
        cable.fmu.terminate()
        with pytest.raises(FMICallException):
            cable.step(0.01, 0.01)


def test_after_a_discarded_step_the_end_of_the_last_good_one_is_known(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        cable.run()
        cable.step(0.0, 0.01)
        cable.set(winch_speed=1e6)
        with pytest.raises(FMICallException) as caught:
            cable.step(0.01, 0.01)
        assert caught.value.status == FMI_DISCARD
        assert cable.fmu.getRealStatus(LAST_SUCCESSFUL_TIME) == 0.01
        with pytest.raises(FMICallException) as caught:
            cable.fmu.getBooleanStatus(TERMINATED)
        assert caught.value.status == FMI_DISCARD
        cable.set(winch_speed=0.0)
        cable.step(0.01, 0.01)


@pytest.mark.parametrize("kind", [0, 1])
def test_inputs_without_an_answer_leave_what_the_last_step_gave(
    complete_fmus: tuple[RobotFmus, RobotFmus], kind: int
) -> None:
    with in_hand(complete_fmus[kind].cables[1]) as cable:
        begin(cable)
        expected = cable.get("position.x", "force.x", "middle_force.x")
        cable.set(position__x=float("nan"))
        tension, middle = cable.get("force.x", "middle_force.x")
        assert np.isnan(tension) and middle == expected[2]
        cable.set(position__x=expected[0])
        assert cable.get("force.x", "middle_force.x") == expected[1:]


def test_parameters_outside_their_bounds_and_inputs_not_finite_are_refused(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        for value in (-1.0, float("nan"), float("inf")):
            with pytest.raises(FMICallException):
                cable.set(modulus=value)
        assert cable.get("modulus")[0] == paper_robot().cables[0].modulus
        cable.set(winch_speed=float("nan"))
        with pytest.raises(FMICallException):
            cable.run()
        cable.set(winch_speed=0.0)
        cable.run()
        cable.set(position__x=float("inf"))
        with pytest.raises(FMICallException):
            cable.step(0.0, 0.01)


@pytest.mark.parametrize("is_running", [False, True], ids=["initialization", "stepping"])
def test_what_is_computed_cannot_be_set(
    is_running: bool, plain_fmus: RobotFmus, capsys: pytest.CaptureFixture[str]
) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        if is_running:
            cable.run()
        computed = [*cable.names("output"), *cable.names("local")]
        before = cable.get("winch_speed", *computed)
        for name in computed:
            with pytest.raises(FMICallException):
                cable.set(winch_speed=0.3, **{name.replace(".", "__"): 1.0})
            assert f"{name} is no input and no parameter" in capsys.readouterr().out
        assert cable.get("winch_speed", *computed) == before


MOVING = {
    "cable_1": (
        {"velocity__x": 0.2, "acceleration__z": 0.7, "winch_speed": 0.4, "winch_acceleration": -0.2},
        "modulus",
    ),
    "platform": ({"force_rate_1__x": 600.0, "external_force_rate__z": -40.0}, "mass"),
    "winch_1": ({"speed_command": 0.1, "speed_command_rate": 2.0}, "damping_ratio"),
}


@pytest.mark.parametrize("component", MOVING)
def test_parameters_set_between_steps_leave_the_inputs_extrapolated(
    complete_fmus: tuple[RobotFmus, RobotFmus], component: str
) -> None:
    inputs, parameter = MOVING[component]
    shown = []
    for fmus in complete_fmus:
        with in_hand(fmus.by_component[component]) as hand:
            outputs = [v.name for v in hand.description.modelVariables if v.causality == "output"]
            hand.set(**inputs)
            hand.run()
            hand.step(0.0, 0.1)
            before, (value,) = hand.get(*outputs), hand.get(parameter)
            hand.set(**{parameter: value})
            assert hand.get(*outputs) == pytest.approx(before, rel=1e-12, abs=1e-12)
            hand.set(**{parameter: 1.1 * value})
            shown.append(hand.get(*outputs))
    assert shown[0] != pytest.approx(before, rel=1e-3)
    assert shown[0] == pytest.approx(shown[1], rel=SAME, abs=SAME)


def test_parameters_that_are_set_move_the_start(complete_fmus: tuple[RobotFmus, RobotFmus]) -> None:
    lengths = []
    for fmus in complete_fmus:
        with in_hand(fmus.cables[0]) as cable:
            cable.set(effect__anchor__z=0.5, effect__pulley__radius=0.2)
            lengths.append(cable.get("unstrained_length", "length", "tension"))
            cable.run()
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-13)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_a_plain_c_compiler_takes_the_source_in_the_archive(plain_fmus: RobotFmus, tmp_path: Path) -> None:
    with zipfile.ZipFile(plain_fmus.platform) as archive:
        archive.extractall(tmp_path)
    headers = Path(fmpy.__file__).parent / "c-code"
    library = tmp_path / "platform.so"
    call = ["gcc", "-std=c99", "-pedantic-errors", "-O1", "-fPIC", "-shared", "-o", str(library), f"-I{headers}"]
    subprocess.run([*call, str(tmp_path / "sources" / "all.c"), "-lm"], check=True)
    names = subprocess.run(["nm", "-D", "--defined-only", str(library)], capture_output=True, text=True, check=True)
    defined = {line.split()[-1] for line in names.stdout.splitlines()}
    assert {name for name in defined if not name.startswith("_")} == {n for n in defined if n.startswith("fmi2")}
    binary = next((tmp_path / "binaries").rglob("platform.so"))
    shutil.copyfile(library, binary)
    with in_hand(plain_fmus.platform) as built:
        built.run()
        built.step(0.0, 0.01)
        expected = built.get("position.x", "position.z", "velocity.z")
    hand = Hand(tmp_path, str(tmp_path))
    hand.run()
    hand.step(0.0, 0.01)
    assert hand.get("position.x", "position.z", "velocity.z") == pytest.approx(expected, rel=1e-12)
    hand.fmu.freeInstance()
