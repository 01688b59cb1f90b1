"""The paper's parameters as files: what is printed, what gives the figures, and the motions they make."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from tautwire.paper.paper_parameters import (
    PARAMETER_SETS,
    ParameterSetName,
    WinchRamp,
    read_parameters,
    with_law,
    with_rope,
)
from tautwire.paper.simulation_records import RigidPathError, reeled_length, rigid_path
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.trajectory import CAROCA_HELIX, PAPER_HELIX
from tests.support.robots import paper_robot

PEAK = WinchRamp("held", (28.86, 0.0, 5.0), (0.3, 0.25, -0.25), 1.0, 7.0)


def test_corrected_helices_are_those_of_the_project() -> None:
    corrected = read_parameters("corrected")
    time = np.linspace(0.0, 50.0, 7)
    for name, known in (("three", PAPER_HELIX), ("caroca", CAROCA_HELIX)):
        assert corrected.helices[name].position(time) == pytest.approx(known.position(time), abs=1e-12)


def test_printed_helix_turns_three_times_and_ends_below_p2() -> None:
    printed = read_parameters("printed").helices["three"]
    assert printed.angle == pytest.approx(6.0 * pi)
    assert printed.position(np.array([50.0]))[0] == pytest.approx([28.86, 0.0, 5.0 + 3.0 * pi], abs=1e-9)


def test_helix_of_fast_ends_at_p2_with_the_printed_numbers() -> None:
    printed = read_parameters("printed").helices["fast"]
    assert printed.position(np.array([40.0]))[0] == pytest.approx([-19.64, 14.27, -138.7], abs=0.02)


@pytest.mark.parametrize("which", PARAMETER_SETS)
def test_every_robot_can_be_held_where_its_motions_start(which: ParameterSetName) -> None:
    parameters = read_parameters(which)
    for name, robot in parameters.robots.items():
        assert parameters.helices[name].position(np.zeros(1))[0] == pytest.approx(robot.platform.start)
        assert np.all(static_tensions(robot) > 0.0)


def test_assumed_fast_has_the_cable_length_of_table_2_and_the_tension_of_figure_10() -> None:
    fast = read_parameters("corrected").robots["fast"]
    lengths = np.linalg.norm(np.array(fast.anchors) - fast.platform.start, axis=1)
    assert lengths == pytest.approx(np.full(6, 284.7), abs=0.01)
    assert static_tensions(fast) == pytest.approx(np.full(6, 26500.0), rel=1e-4)


def test_ramp_is_held_or_falls_to_rest() -> None:
    time = np.array([0.0, 2.0, 4.0, 6.0, 7.0])
    assert PEAK.speeds(time)[:, 0] == pytest.approx([0.0, 0.6, 1.0, 1.0, 1.0])
    trapezoid = WinchRamp("trapezoid", PEAK.start, PEAK.accelerations, PEAK.peak_speed, PEAK.duration)
    assert trapezoid.speeds(time)[:, 2] == pytest.approx([0.0, -0.5, -0.75, -0.25, 0.0])
    assert PEAK.peak_time == pytest.approx(10.0 / 3.0)


def test_inelastic_ropes_meet_where_their_lengths_say() -> None:
    robot, time = paper_robot(), np.linspace(0.0, 7.0, 211)
    speeds = PEAK.speeds(time)
    path = rigid_path(robot, time, speeds)
    lengths = np.linalg.norm(np.array(robot.anchors)[None] - path[:, None], axis=2)
    assert lengths == pytest.approx(lengths[0] - reeled_length(time, speeds), abs=1e-9)
    assert path[-1] == pytest.approx([20.28, 0.227, 8.56], abs=0.005), "P3 as printed, but for rounding"


def test_ropes_too_short_to_meet_are_refused() -> None:
    robot, time = paper_robot(), np.linspace(0.0, 60.0, 61)
    with pytest.raises(RigidPathError) as caught:
        rigid_path(robot, time, np.full((61, 3), 1.0))
    assert 0.0 < caught.value.time <= 60.0


def test_ropes_and_laws_are_changed_on_all_cables() -> None:
    robot = with_rope(with_law(paper_robot(), "linear"), 1e11, 2e9)
    assert {(c.law, c.modulus, c.damping, c.area) for c in robot.cables} == {("linear", 1e11, 2e9, pi * 0.002**2)}
