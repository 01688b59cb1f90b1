import control
import numpy as np
import pytest

from tautwire.errors import InputError
from tautwire.linear import linearise, minimal, transfer_function
from tests.support.robots import NAMES, example, paper_robot

FREQUENCIES = 2j * np.pi * np.geomspace(0.01, 100.0, 60)


@pytest.mark.parametrize("name", NAMES)
def test_every_channel_keeps_its_frequency_response(name: str) -> None:
    system = linearise(example(name)).system
    response = system(FREQUENCIES)
    for row, target in enumerate(system.output_labels):
        # What only rounding lets through, as across a plane of symmetry, is no channel.
        largest = np.abs(response[row]).max()
        for column, source in enumerate(system.input_labels):
            if np.abs(response[row, column]).max() < 1e-9 * largest:
                continue
            channel = minimal(system, source, target)
            assert channel(FREQUENCIES) == pytest.approx(response[row, column], rel=1e-6, abs=1e-12 * largest)


def test_a_channel_has_no_unstrained_length_that_does_not_act_in_it() -> None:
    system = linearise(example("eight")).system
    assert system.nstates == 14
    # One winch moves one rope; a force moves none, and each axis of this robot is a mode of its own.
    assert minimal(system, "winch_speed_1", "tension_1").nstates == 7
    assert minimal(system, "external_force_z", "position_z").nstates == 2
    assert np.abs(minimal(system, "external_force_z", "position_z").poles()).min() > 1.0


def test_what_symmetry_keeps_apart_is_no_channel() -> None:
    channel = minimal(linearise(example("eight")).system, "external_force_z", "position_x")
    assert channel.nstates == 0
    assert channel(1j) == 0.0


def test_orders_do_not_hang_on_the_tolerance() -> None:
    system = linearise(example("caroca"), (0.3, 0.2, 1.4)).system
    for source, target in (("winch_speed_2", "length_3"), ("external_force_x", "tension_1")):
        orders = {minimal(system, source, target, 10.0**-power).nstates for power in range(6, 12)}
        assert len(orders) == 1


def test_several_inputs_and_outputs_keep_their_names() -> None:
    inputs, outputs = ["winch_speed_2", "winch_speed_1"], ["tension_1", "position_z"]
    system = linearise(example("caroca")).system
    reduced = minimal(system, inputs, outputs)
    assert (reduced.input_labels, reduced.output_labels) == (inputs, outputs)
    assert reduced(5j) == pytest.approx(np.asarray(system[outputs, inputs](5j)), rel=1e-8)


def test_none_named_are_all() -> None:
    system = linearise(example("eight")).system
    assert minimal(system).nstates == system.nstates
    places = ["position_x", "position_y", "position_z"]
    reduced = minimal(system, outputs=places)
    assert reduced.input_labels == system.input_labels
    # Eight ropes move three axes.
    assert reduced.nstates == 9
    assert reduced(5j) == pytest.approx(np.asarray(system[places, system.input_labels](5j)), rel=1e-8, abs=1e-15)


def test_the_transfer_function_of_a_vertical_force_by_hand() -> None:
    # One mode of the eight cables is vertical: 1 / (m s^2 + c s + k).
    plant = linearise(example("eight"))
    mode = int(np.argmax(np.abs(plant.modes.shapes[2])))
    omega, ratio = 2 * np.pi * plant.modes.frequencies[mode], plant.modes.damping_ratios[mode]
    result = transfer_function(plant.system, "external_force_z", "position_z")
    assert isinstance(result, control.TransferFunction)
    numerator, denominator = result.num_array[0, 0], result.den_array[0, 0]
    assert denominator / denominator[0] == pytest.approx([1.0, 2.0 * ratio * omega, omega**2], rel=1e-9)
    assert numerator[-1] / denominator[0] == pytest.approx(1.0 / 60.0, rel=1e-9)


def test_a_transfer_function_keeps_its_names_and_integrates_the_winch() -> None:
    result = transfer_function(linearise(paper_robot(damping=4e8)).system, "winch_speed_1", "position_x")
    assert (result.input_labels, result.output_labels) == (["winch_speed_1"], ["position_x"])
    assert np.sum(np.abs(result.poles()) < 1e-6) == 1


def test_an_unknown_signal_is_refused() -> None:
    system = linearise(paper_robot()).system
    with pytest.raises(InputError, match=r"no input 'winch_1'; choose among winch_speed_1"):
        transfer_function(system, "winch_1", "position_x")
    with pytest.raises(InputError, match="no output 'x'"):
        minimal(system, "winch_speed_1", ["position_x", "x"])
