"""Derivatives of inputs and outputs by the functions that FMI has for them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Integer, fmi2Real, fmi2ValueReference
from fmpy.fmi3 import FMU3Slave

from tautwire.fmus.packaging import RobotFmus, build_fmus
from tests.support.fmus import Hand, in_hand
from tests.support.robots import paper_robot

FMI_OK, FMI_WARNING = 0, 1


@pytest.fixture(scope="module")
def plain_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    """The paper's robot, native."""
    return build_fmus(paper_robot(), tmp_path_factory.mktemp("plain"), native=True)


def test_derivatives_of_inputs_are_the_inputs_that_are_their_rates(plain_fmus: RobotFmus) -> None:
    shown = []
    for by_derivative in (False, True):
        with in_hand(plain_fmus.cables[0]) as cable:
            cable.run()
            if by_derivative:
                references = [cable.references[name] for name in ("winch_speed", "position.x", "position.x")]
                cable.fmu.setRealInputDerivatives(references, [1, 1, 2], [0.3, 0.1, -2.0])
            else:
                cable.set(winch_acceleration=0.3, velocity__x=0.1, acceleration__x=-2.0)
            cable.step(0.0, 0.02)
            shown.append(cable.get("tension", "force.x", "wound_length"))
    assert shown[0] == shown[1]
    assert shown[0][2] == pytest.approx(0.3 * 0.02**2 / 2, rel=1e-12)


def set_derivatives(hand: Hand, derivatives: Sequence[tuple[str, int, float]]) -> int:
    """Set derivatives, each a name, an order and a value; the status."""
    names, orders, values = zip(*derivatives, strict=True)
    count = len(names)
    references = (fmi2ValueReference * count)(*(hand.references[name] for name in names))
    status: int = hand.fmu.fmi2SetRealInputDerivatives(
        hand.fmu.component, references, count, (fmi2Integer * count)(*orders), (fmi2Real * count)(*values)
    )
    return status


def test_derivatives_of_inputs_beyond_their_rates_are_ignored_with_a_warning(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        cable.run()
        used = [("position.x", 1, 0.1), ("winch_speed", 1, 0.3)]
        assert set_derivatives(cable, used) == FMI_OK
        surplus = [("acceleration.x", 1, 5.0), ("position.x", 3, 7.0)]
        assert set_derivatives(cable, [*surplus, ("position.x", 2, -2.0)]) == FMI_WARNING
        assert cable.get("velocity.x", "winch_acceleration", "acceleration.x") == [0.1, 0.3, -2.0]
        for name, order in (("position.x", 0), ("tension", 1), ("modulus", 1)):
            with pytest.raises(FMICallException):
                set_derivatives(cable, [(name, order, 0.0)])


def test_outputs_give_the_derivatives_that_they_have_and_zero_beyond(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.platform) as platform:
        platform.set(force_rate_1__x=600.0)
        platform.run()
        platform.step(0.0, 0.1)
        highest = platform.description.coSimulation.maxOutputDerivativeOrder
        expected = platform.get("velocity.x", "acceleration.x")
        orders = list(range(1, highest + 3))
        position = [platform.references["position.x"]] * len(orders)
        derivatives = platform.fmu.getRealOutputDerivatives(position, orders)
        assert derivatives == [*expected, *[0.0] * (len(orders) - 2)] and expected[1] != 0.0
    assert highest == 2


def test_no_derivatives_are_given_of_what_is_no_output(plain_fmus: RobotFmus) -> None:
    with in_hand(plain_fmus.cables[0]) as cable:
        cable.set(velocity__z=-0.3, winch_speed=0.4)
        cable.run()
        tension, length = cable.references["tension"], cable.references["length"]
        shown = cable.fmu.getRealOutputDerivatives([tension, tension, length], [1, 2, 1])
        assert shown == [*cable.get("tension_rate"), 0.0, 0.0] and shown[0] != 0.0
        for reference, order in (
            (length, 0),
            (tension, -1),
            (cable.references["acceleration.x"], 1),
            (cable.references["modulus"], 1),
            (9999, 1),
        ):
            with pytest.raises(FMICallException):
                cable.fmu.getRealOutputDerivatives([reference], [order])


def test_fmi_3_gives_the_same_derivatives(tmp_path: Path) -> None:
    path = build_fmus(paper_robot(), tmp_path, native=True, fmi=3).cables[0]
    description = fmpy.read_model_description(str(path))
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    fmpy.extract(str(path), str(tmp_path / "cable"))
    name = description.coSimulation.modelIdentifier
    fmu = FMU3Slave(guid=description.guid, unzipDirectory=str(tmp_path / "cable"), modelIdentifier=name)
    fmu.instantiate()
    fmu.enterInitializationMode()
    fmu.setFloat64([references["winch_speed"]], [0.4])
    fmu.exitInitializationMode()
    tension, length = references["tension"], references["length"]
    shown = fmu.getOutputDerivatives([tension, tension, length], [1, 2, 1])
    assert shown == [*fmu.getFloat64([references["tension_rate"]]), 0.0, 0.0] and shown[0] != 0.0
    for reference, order in ((length, 0), (references["modulus"], 1), (references["time"], 1)):
        with pytest.raises(FMICallException):
            fmu.getOutputDerivatives([reference], [order])
    fmu.freeInstance()
