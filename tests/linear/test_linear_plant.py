"""The linearised plant against equations written here once more, hand-solved robots and the paper."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.errors import InputError, UnreachableError
from tautwire.linear import OperatingPointError, linear_plant, linearise, model_document
from tautwire.linear.modes import cable_energies
from tautwire.linear.operating_point import Pose
from tautwire.robot.pose_stiffness import stiffness_matrix
from tautwire.robot.schema import Cable, EffectSetting, Platform, Robot, Sensors, TensionLimits
from tautwire_fmu.laws.effects import BY_NAME, Effect, Parameter, State
from tautwire_fmu.laws.effects.damping import Values

Array = NDArray[np.float64]

PAPER_ANCHORS = ((0.0, 50.0, 50.0), (0.0, -50.0, 50.0), (86.6, 0.0, 50.0))
DISC = pi * 0.002**2
METAL = 7.1675e-6


def robot_of(
    anchors: tuple[tuple[float, float, float], ...],
    start: tuple[float, float, float],
    mass: float,
    modulus: float,
    area: float = DISC,
    damping: float = 0.0,
    law: str = "logarithmic",
    limits: TensionLimits | None = None,
) -> Robot:
    """A robot of equal cables under the paper's gravity."""
    cables = tuple(Cable(anchor, modulus, area, damping, law) for anchor in anchors)
    return Robot("test", 9.8, Platform(mass, start), limits, Sensors(), cables)


def paper_robot(modulus: float = 1.022e11, area: float = DISC, damping: float = 0.0) -> Robot:
    return robot_of(PAPER_ANCHORS, (28.86, 0.0, 5.0), 300.0, modulus, area, damping)


def symmetric_robot(damping: float = 0.0, law: str = "logarithmic") -> Robot:
    """Three cables at 120 degrees, 4 m out and 3 m up: 5 m long, sine 0.6, cosine 0.8."""
    anchors = tuple((4.0 * np.cos(a), 4.0 * np.sin(a), 3.0) for a in 2.0 * pi * np.arange(3) / 3.0)
    return robot_of(anchors, (0.0, 0.0, 0.0), 50.0, 1e9, 1e-5, damping, law)


def eight_robot() -> Robot:
    anchors = tuple((x, y, z) for z in (6.0, 0.0) for x in (0.0, 10.0) for y in (0.0, 8.0))
    limits = TensionLimits(minimum=100.0, maximum=4000.0, preferred=600.0)
    return robot_of(anchors, (4.0, 4.5, 2.5), 60.0, 6e10, 3.2e-6, 3e8, limits=limits)


def own_equations(robot: Robot, start_tensions: Array, states: Array, inputs: Array) -> tuple[Array, Array]:
    """Rates and outputs of an effect-free robot, written from the paper."""
    count = len(robot.cables)
    position, velocity, ropes = states[:3], states[3:6], states[6:]
    speeds, force = inputs[:count], inputs[count:].copy()
    rates, tensions, lengths = np.zeros(count), np.zeros(count), np.zeros(count)
    for i, cable in enumerate(robot.cables):
        span = np.array(cable.anchor) - position
        length = np.sqrt(np.sum(span**2))
        unit = span / length
        if cable.law == "logarithmic":
            strain, rates[i] = np.log(length / ropes[i]), -speeds[i] * ropes[i] / length
        else:
            strain, rates[i] = 1.0 - ropes[i] / length, -speeds[i]
        strain_rate = (speeds[i] - unit @ velocity) / length
        axial = cable.area * (cable.modulus * strain + cable.damping * strain_rate)
        tensions[i], lengths[i] = axial + start_tensions[i], length
        force += tensions[i] * unit
    acceleration = force / robot.platform.mass - np.array([0.0, 0.0, robot.gravity])
    rates = np.concatenate([velocity, acceleration, rates])
    return rates, np.concatenate([position, velocity, tensions, lengths])


def slopes(function, at: Array) -> Array:  # type: ignore[no-untyped-def]
    """Jacobian by central differences."""
    push = 1e-5 * np.eye(len(at))
    return np.column_stack([(function(at + p) - function(at - p)) / 2e-5 for p in push])


def start_tensions(robot: Robot) -> Array:
    return linearise(robot).tensions


@pytest.mark.parametrize("at", [None, (1.0, -0.5, 0.7)])
@pytest.mark.parametrize("law", ["logarithmic", "linear"])
def test_matrices_are_the_derivatives_of_the_equations(law: str, at: tuple[float, float, float] | None) -> None:
    compare(symmetric_robot(damping=3e7, law=law), at)


@pytest.mark.parametrize("at", [None, (6.0, 3.0, 4.0)])
def test_matrices_with_eight_cables(at: tuple[float, float, float] | None) -> None:
    compare(eight_robot(), at)


def compare(robot: Robot, at: tuple[float, float, float] | None) -> None:
    plant, tensions = linearise(robot, at), start_tensions(robot)
    still = np.zeros(plant.system.ninputs)
    by_state = slopes(lambda x: np.concatenate(own_equations(robot, tensions, x, still)), plant.state)
    by_input = slopes(lambda u: np.concatenate(own_equations(robot, tensions, plant.state, u)), still)
    states = plant.system.nstates
    expected = {"A": by_state[:states], "B": by_input[:states], "C": by_state[states:], "D": by_input[states:]}
    for name, matrix in expected.items():
        result = getattr(plant.system, name)
        assert np.allclose(result, matrix, rtol=1e-6, atol=1e-7 * np.abs(matrix).max()), name


@pytest.mark.parametrize("law", ["logarithmic", "linear"])
def test_unstrained_lengths_elsewhere_are_those_of_the_inverse_law(law: str) -> None:
    robot = symmetric_robot(law=law)
    at = np.array([0.8, 0.3, -0.4])
    plant, before = linearise(robot, at), start_tensions(robot)
    lengths = np.linalg.norm(np.array(robot.anchors) - at, axis=1)
    strains = (plant.tensions - before) / 1e4
    expected = lengths * (np.exp(-strains) if law == "logarithmic" else 1.0 - strains)
    assert plant.state[6:] == pytest.approx(expected, rel=1e-12)
    rates, outputs = own_equations(robot, before, plant.state, np.zeros(6))
    assert np.abs(rates).max() < 1e-9
    assert outputs[6:9] == pytest.approx(plant.tensions, rel=1e-9)


def test_frequencies_and_damping_of_a_symmetric_robot_by_hand() -> None:
    plant = linearise(symmetric_robot(damping=2e6))
    tension, axial, length, mass = 50.0 * 9.8 / 1.8, 1e4, 5.0, 50.0
    across, up = 1.5 * 0.64, 3.0 * 0.36
    stiffness = (np.array([across, across, up]) * (axial - tension) + 3.0 * tension) / length
    viscosity = np.array([across, across, up]) * 2e6 * 1e-5 / length
    order = np.argsort(stiffness)
    assert plant.modes.frequencies == pytest.approx(np.sqrt(stiffness[order] / mass) / (2 * pi), rel=1e-12)
    ratios = viscosity / (2.0 * np.sqrt(stiffness * mass))
    assert plant.modes.damping_ratios == pytest.approx(ratios[order], rel=1e-9)
    vertical = int(np.flatnonzero(order == 2)[0])
    assert plant.modes.shapes[:, vertical] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert plant.modes.cable_shares[:, vertical] == pytest.approx(np.full(3, 1.0 / 3.0))


def test_overdamped_modes_keep_their_damping_ratio() -> None:
    light = linearise(symmetric_robot(damping=2e6)).modes
    heavy = linearise(symmetric_robot(damping=2e9)).modes
    assert heavy.damping_ratios == pytest.approx(1000.0 * light.damping_ratios, rel=1e-6)
    assert heavy.damping_ratios.min() > 1.0
    assert np.all(heavy.damped_frequencies == 0.0)
    assert light.damped_frequencies == pytest.approx(
        light.frequencies * np.sqrt(1.0 - light.damping_ratios**2), rel=1e-6
    )


def test_frequencies_of_the_paper() -> None:
    assert linearise(paper_robot()).modes.frequencies == pytest.approx([1.18, 1.18, 1.30], abs=0.005)
    assert linearise(paper_robot(area=METAL)).modes.frequencies[:2] == pytest.approx([0.89, 0.89], abs=0.005)


def test_frequencies_follow_the_root_of_the_modulus() -> None:
    # Tension alone also holds the platform a little, so the ratio falls short by some 1e-4.
    ratio = linearise(paper_robot(1.348e11)).modes.frequencies / linearise(paper_robot()).modes.frequencies
    assert ratio == pytest.approx(np.full(3, sqrt(134.8 / 102.2)), rel=1e-3)


def test_damping_ratio_is_that_of_the_cable_to_first_order() -> None:
    modes = linearise(paper_robot(damping=4e8)).modes
    assert modes.damping_ratios == pytest.approx(4e8 * 2 * pi * modes.frequencies / (2 * 1.022e11), rel=5e-3)


def test_shares_of_the_cables_sum_to_one_and_are_positive() -> None:
    shares = linearise(eight_robot()).modes.cable_shares
    assert shares.sum(axis=0) == pytest.approx(np.ones(3))
    assert shares.min() > 0.0


def test_unstrained_lengths_add_zero_eigenvalues() -> None:
    values = np.linalg.eigvals(linearise(eight_robot()).system.A)
    assert np.sum(np.abs(values) < 1e-9) == 8
    assert np.sum(values.imag > 1.0) == 3


def test_signals_are_named_and_usable() -> None:
    system = linearise(symmetric_robot(damping=2e7)).system
    assert system.state_labels[6] == "unstrained_length_1"
    assert system.input_labels == [*(f"winch_speed_{i}" for i in (1, 2, 3)), *(f"external_force_{a}" for a in "xyz")]
    # Slowly enough for statics; at zero itself the unstrained lengths make the state matrix singular.
    lift = abs(system["position_z", "external_force_z"](1e-4j))
    plant = linearise(symmetric_robot())
    stiffness = 50.0 * (2 * pi * plant.modes.frequencies[plant.modes.shapes[2] > 0.9][0]) ** 2
    assert lift == pytest.approx(1.0 / stiffness, rel=1e-6)


def test_document_is_json_with_the_agreed_keys() -> None:
    document = json.loads(json.dumps(model_document(linearise(eight_robot())), allow_nan=False))
    assert set(document) == {
        *("position", "tensions", "frequencies_hz", "damping_ratios", "mode_shapes"),
        *("A", "B", "C", "D", "states", "inputs", "outputs"),
        *("damped_frequencies_hz", "cable_shares", "translational_shares", "orientation", "notes"),
    }
    assert np.shape(document["A"]) == (14, 14) and len(document["states"]) == 14
    assert np.shape(document["B"]) == (14, 11) and len(document["inputs"]) == 11
    assert np.shape(document["C"]) == (22, 14) and len(document["outputs"]) == 22
    assert document["frequencies_hz"] == sorted(document["frequencies_hz"])


@pytest.mark.parametrize("at", [(9.0, 0.0, 0.0), (0.0, 0.0, 8.0)])
def test_position_that_no_cable_can_hold_is_refused(at: tuple[float, float, float]) -> None:
    with pytest.raises(UnreachableError, match="cannot be held"):
        linearise(symmetric_robot(), at)


def test_position_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="three finite coordinates"):
        linearise(symmetric_robot(), (0.0, float("nan"), 0.0))


def branch(name: str, rate) -> Effect:  # type: ignore[no-untyped-def]
    """A made-up effect with one state that adds stiffness, for the treatment of states."""
    parameter = Parameter("damping", "s", "time of the branch", 0.0, 1e3, None, 1.0)
    return Effect(
        name=name,
        component="cable",
        description="for this test only",
        parameters=(parameter,),
        values=Values,
        source="none",
        states=(State("inner", "1", "inner strain"),),
        state_rates=rate,
        tension=lambda m, values, states, cable, motion: 5e3 * (motion.strain - states[0]),
    )


def with_branch(monkeypatch: pytest.MonkeyPatch, name: str, rate) -> Robot:  # type: ignore[no-untyped-def]
    monkeypatch.setitem(BY_NAME, name, branch(name, rate))
    return symmetric_robot().with_effect(EffectSetting(name, {"damping": 0.5}, (1, 2, 3)))


def test_states_of_effects_have_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = with_branch(monkeypatch, "branch", lambda m, v, s, cable, motion: ((motion.strain - s[0]) / v.damping,))
    plant = linearise(robot, (0.8, 0.3, -0.4))
    plain = linearise(symmetric_robot(), (0.8, 0.3, -0.4))
    assert plant.system.state_labels[9:] == [f"branch_inner_{i}" for i in (1, 2, 3)]
    strains = (plain.tensions - linearise(symmetric_robot()).tensions) / 1e4
    assert plant.state[9:] == pytest.approx(strains, rel=1e-6)
    assert plant.modes.frequencies[0] > 1.1 * plain.modes.frequencies[0]
    assert np.all(plant.modes.damping_ratios > 0.0)


def test_the_model_is_assembled_once_for_all_positions(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, assembled = replace(symmetric_robot(), name="assembled once"), []
    assemble = linear_plant.symbolic_model
    monkeypatch.setattr(linear_plant, "symbolic_model", lambda *r, **o: assembled.append(r) or assemble(*r, **o))
    here, there, again = (linearise(robot, (x, 0.3, -0.4)) for x in (0.8, -0.8, 0.8))
    assert len(assembled) == 1
    assert np.array_equal(here.system.A, again.system.A) and not np.allclose(here.system.A, there.system.A)


def test_effect_that_never_settles_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = with_branch(monkeypatch, "drift", lambda m, v, s, cable, motion: (1.0 + 0.0 * motion.strain,))
    with pytest.raises(OperatingPointError, match="never converge"):
        linearise(robot)


def test_the_energies_of_cables_with_moved_exit_points_are_those_of_the_stiffness() -> None:
    robot = paper_robot().with_effect(EffectSetting("anchor", {"x": 20.0, "y": 10.0, "z": -30.0}, (1,)))
    plant = linearise(robot)
    pose, shapes = Pose(robot, plant.position, plant.orientation), plant.modes.shapes
    energies = cable_energies(pose, plant.tensions, plant.tension_slopes, shapes)
    stiffness = stiffness_matrix(robot, plant.tensions, plant.position)
    assert energies.sum(axis=0) == pytest.approx(np.diag(shapes.T @ stiffness @ shapes), rel=1e-9)
