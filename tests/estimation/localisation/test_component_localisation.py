"""Localisation of the faulty component by residuals at the measured ports, on recordings that the rig makes."""

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from tautwire.estimation.disturbance import Disturbance, OrnsteinUhlenbeck
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.localisation.component_localisation import _load_cell_candidates, localise_residual
from tautwire.estimation.localisation.component_residuals import ComponentResidual, FaultLocalisation
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Cable, Robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.recordings import recorded
from tests.support.robots import example

ALL = "cables 1, 2, 3 (rope or winch) or the position sensor"
MANY = "load cells 1, 2, 3; exit points 1, 2, 3; the position sensor or several components"
HIDDEN: list[tuple[dict[str, Any], str]] = [
    ({}, "nothing"),
    ({"damping": {"damping": 9e8}}, ALL),
    ({"modulus": {"modulus": 0.95e11, "cables": [2]}}, "cable 2 (rope or winch)"),
    ({"drum": {"radius_ratio": 1.003, "cables": [2]}}, "cable 2 (rope or winch)"),
    ({"payload": {"mass": 6.0}}, "platform"),
    ({"drag": {"drag_area": 20.0}}, "platform"),
    ({"sensor_offset": {"force": 40.0, "cables": [2]}}, "load cell 2 (its zero) or platform"),
    ({"sensor_gain": {"gain": 1.02, "cables": [3]}}, "load cell 3 or friction before it"),
    ({"sensor_delay": {"seconds": 0.03, "cables": [1]}}, "load cell 1 or friction before it"),
    (
        {"anchor": {"x": 0.05, "y": -0.04, "z": 0.08, "cables": [1]}},
        "load cell 1; exit point 1 or several components",
    ),
    ({"anchor": {"x": 0.0075, "y": -0.006, "z": 0.012, "cables": [1]}}, "cable 1 (rope, winch or exit point)"),
    ({"friction": {"coefficient": 0.02, "cables": [2]}}, "load cell 2 or friction before it"),
    ({"damping": {"damping": 9e8}, "payload": {"mass": 6.0}}, MANY),
]


def localise(robot: Robot, recording: Recording) -> FaultLocalisation:
    noise = estimate_noise(robot, recording)
    return localise_residual(robot, split_data(robot, noise, recording, recording).estimation, noise)


@cache
def _localised(text: str) -> FaultLocalisation:
    return localise(example("three"), recorded("three", 3, json.loads(text)))


def localised(effects: dict[str, Any]) -> FaultLocalisation:
    """The localisation for the three-cable robot with hidden effects; computed once."""
    return _localised(json.dumps(effects))


def residual_of(components: FaultLocalisation, component: str, quantity: str = "tension") -> ComponentResidual:
    return next(p for p in components.residuals if (p.component, p.quantity) == (component, quantity))


@pytest.mark.validate(but=["6.0}}-platform"])
@pytest.mark.parametrize(("effects", "component"), HIDDEN, ids=str)
def test_the_component_in_question_is_named(effects: dict[str, Any], component: str) -> None:
    assert localised(effects).faulty_component == component


def test_where_nothing_is_hidden_residuals_are_as_large_as_expected() -> None:
    components = localised({})
    assert [p.component for p in components.residuals] == ["cable 1", "cable 2", "cable 3", *["platform"] * 3]
    for each in components.residuals:
        assert 0.8 < each.ratio < 1.2
        assert each.correlated_signal is None and each.resonance_frequency is None
        assert each.residual.shape == components.time.shape
    assert components.limitations == ()


@pytest.mark.validate(but=["effects4"])
@pytest.mark.parametrize(
    ("effects", "component", "quantity", "signal", "sign"),
    [
        ({"damping": {"damping": 9e8}}, "cable 1", "tension", "strain rate", 1),
        ({"modulus": {"modulus": 0.95e11, "cables": [2]}}, "cable 2", "tension", "tension", -1),
        ({"drum": {"radius_ratio": 1.003, "cables": [2]}}, "cable 2", "tension", "winch travel", 1),
        ({"drag": {"drag_area": 20.0}}, "platform", "force z", "velocity times speed z", -1),
        ({"payload": {"mass": 6.0}}, "platform", "force z", "acceleration z", -1),
    ],
)
def test_the_signal_correlated_with_a_residual_is_named(
    effects: dict[str, Any], component: str, quantity: str, signal: str, sign: int
) -> None:
    correlation = residual_of(localised(effects), component, quantity).correlated_signal
    assert correlation is not None and correlation.name == signal
    assert sign * correlation.correlation > 0.8


def test_a_payload_shows_by_its_weight_and_not_at_the_cables() -> None:
    components = localised({"payload": {"mass": 6.0}})
    assert residual_of(components, "platform", "force z").mean == pytest.approx(-6.0 * 9.81, rel=0.02)
    assert not any(p.is_significant for p in components.residuals if p.component != "platform")
    assert components.ranking[0].quantity == "force z"


@pytest.mark.validate
def test_a_swinging_load_shows_as_a_resonance_of_the_platform() -> None:
    components = localised({"unlisted_swing": {"mass": 20.0, "length": 2.0}})
    assert components.faulty_component == "platform"
    frequency = residual_of(components, "platform", "force x").resonance_frequency
    assert frequency == pytest.approx(np.sqrt(9.81 / 2.0) / (2.0 * np.pi), rel=0.06)
    assert "oscillates at 0.3" in components.sentence


def test_without_positions_no_component_is_localised() -> None:
    recording = recorded("three", 3)
    blind = replace(recording, position=np.full_like(recording.position, np.nan))
    components = localise(example("three"), blind)
    assert (components.residuals, components.faulty_component) == ((), "cannot tell")
    assert "positions are missing" in components.limitations[0]
    one_axis = recording.position.copy()
    one_axis[:, 1] = np.nan
    assert localise(example("three"), replace(recording, position=one_axis)).faulty_component == "cannot tell"


def test_without_tensions_no_component_is_localised() -> None:
    recording = recorded("three", 3)
    components = localise(example("three"), replace(recording, tension=np.full_like(recording.tension, np.nan)))
    assert (components.residuals, components.faulty_component) == ((), "cannot tell")
    assert "no tensions" in components.limitations[0]


@pytest.mark.validate
def test_without_one_load_cell_the_other_cables_are_still_localised() -> None:
    recording = recorded("three", 3, {"modulus": {"modulus": 0.95e11, "cables": [2]}})
    tension = recording.tension.copy()
    tension[:, 2] = np.nan
    components = localise(example("three"), replace(recording, tension=tension))
    assert [p.component for p in components.residuals] == ["cable 1", "cable 2"]
    assert components.faulty_component == "cable 2 (rope, winch, load cell or exit point)"
    assert "cable 3" in components.limitations[0]


@pytest.mark.validate
def test_dropouts_do_no_harm() -> None:
    recording = recorded("three", 3, gap=(5.0, 5.6))
    position, tension = recording.position.copy(), recording.tension.copy()
    position[np.arange(len(position)) % 5 != 0] = np.nan
    tension[300:330, 1] = np.nan
    components = localise(example("three"), replace(recording, position=position, tension=tension))
    assert components.faulty_component == "nothing"
    assert np.all(np.isnan(residual_of(components, "cable 2").residual[300:330]))


def test_a_flat_robot_needs_no_positions_across_it() -> None:
    robot = example("three")
    flat: list[Cable] = [replace(c, anchor=(c.anchor[0], 0.0, c.anchor[2])) for c in robot.cables]
    robot = replace(robot, cables=tuple(flat[1:]))
    time = np.arange(0.0, 8.0, 0.02)
    still = np.zeros((len(time), 2))
    random = np.random.default_rng(1)
    place = np.array(robot.platform.start) + random.normal(0.0, 3e-4, (len(time), 3))
    place[:, 1] = np.nan
    tension = static_tensions(robot) + random.normal(0.0, 2.0, still.shape)
    components = localise(robot, Recording("flat", time, still, tension, place))
    assert {p.quantity for p in components.residuals} == {"tension", "force x", "force z"}
    assert components.faulty_component == "nothing"


@pytest.mark.validate
@pytest.mark.parametrize("name", ["caroca", "eight"])
def test_faults_of_other_robots_are_localised(name: str) -> None:
    robot = example(name)
    assert localise(robot, recorded(name, 3)).faulty_component == "nothing"
    assert (
        localise(robot, recorded(name, 3, {"payload": {"mass": 0.02 * robot.platform.mass}})).faulty_component
        == "platform"
    )


@pytest.mark.validate
def test_errors_of_recorded_lengths_are_expected_in_the_place_of_a_drift() -> None:
    robot, recording = example("three"), recorded("three", 3)
    noise = replace(estimate_noise(robot, recording), rope_lengths=(OrnsteinUhlenbeck(1e-4, 5.0),) * 3)
    sample = split_data(robot, noise, recording, recording).estimation
    lengths = residual_of(localise_residual(robot, sample, noise), "cable 1").expected_rms
    none = replace(noise, rope_lengths=(), winch_speed=0.0)
    bare = residual_of(localise_residual(robot, sample, none), "cable 1").expected_rms
    cable = robot.cables[0]
    length = float(np.linalg.norm(np.subtract(cable.anchor, robot.platform.start)))
    # The path leads some way from the start.
    assert np.sqrt(lengths**2 - bare**2) == pytest.approx(1e-4 * cable.modulus * cable.area / length, rel=0.1)


def with_anchor_shifted(axis: int, shift: float) -> Robot:
    robot = example("three")
    anchor = list(robot.cables[0].anchor)
    anchor[axis] += shift
    x, y, z = anchor
    return replace(robot, cables=(replace(robot.cables[0], anchor=(x, y, z)), *robot.cables[1:]))


def with_first_cable(robot: Robot, **changes: float) -> Robot:
    return replace(robot, cables=(replace(robot.cables[0], **changes), *robot.cables[1:]))  # type: ignore[arg-type]


def with_cable(**changes: float) -> Robot:
    return with_first_cable(example("three"), **changes)


def with_tensions(gain: float = 1.0, offset: float = 0.0, *, cable: int) -> Recording:
    recording = recorded("three", 3)
    tension = recording.tension.copy()
    tension[:, cable] = gain * tension[:, cable] + offset
    return replace(recording, tension=tension)


def expected_increase(robot: Robot, component: str, quantity: str) -> float:
    """By how much the expected mean square is larger than of the robot without uncertainties."""
    stated, exact = (
        residual_of(localise(each, recorded("three", 3)), component, quantity) for each in (robot, example("three"))
    )
    return stated.expected_rms**2 - exact.expected_rms**2


def mean_square_changes(component: str, quantity: str, *changed: tuple[Robot, Recording]) -> float:
    """Summed mean squares of what each of these changes alters in a residual."""
    before = residual_of(localised({}), component, quantity).residual
    after = [residual_of(localise(*each), component, quantity).residual for each in changed]
    return float(sum(np.nanmean((residual - before) ** 2) for residual in after))


def with_positions(shift: float, axis: int) -> Recording:
    recording = recorded("three", 3)
    return replace(recording, position=recording.position + shift * np.eye(3)[axis])


def stated(**uncertainties: float) -> Robot:
    """The robot with uncertain numbers of its first cable, or of its sensors."""
    robot = example("three")
    if all(hasattr(robot.sensors, name) for name in uncertainties):
        return replace(robot, sensors=replace(robot.sensors, **uncertainties))
    return with_cable(**uncertainties)


def changed_by_what_is_uncertain(name: str) -> list[tuple[Robot, Recording]]:
    """The robot and its recording with one uncertain number after the other off by what is stated."""
    robot, recording = example("three"), recorded("three", 3)
    if name == "anchor_uncertainty":
        return [(with_anchor_shifted(axis, 0.02), recording) for axis in range(3)]
    if name == "position_offset_uncertainty":
        return [(robot, with_positions(0.02, axis)) for axis in range(3)]
    if name == "modulus_uncertainty":
        return [(with_cable(modulus=1.032e11), recording)]
    if name == "damping_uncertainty":
        return [(with_cable(damping=5e8), recording)]
    return [(robot, with_tensions(gain=1.01, cable=0))]


@pytest.mark.validate
@pytest.mark.parametrize(
    ("name", "uncertainty"),
    [
        ("anchor_uncertainty", 0.02),
        ("modulus_uncertainty", 1e9),
        ("tension_gain_uncertainty", 0.01),
    ],
)
def test_a_cables_residual_is_expected_to_hold_what_the_robot_file_calls_uncertain(
    name: str, uncertainty: float
) -> None:
    increase = expected_increase(stated(**{name: uncertainty}), "cable 1", "tension")
    changes = mean_square_changes("cable 1", "tension", *changed_by_what_is_uncertain(name))
    assert increase == pytest.approx(changes, rel=0.15)


@pytest.mark.validate
def test_an_uncertain_damping_is_expected_also_where_none_is_declared() -> None:
    undamped = with_cable(damping=0.0)
    exact, uncertain = (
        residual_of(localise(robot, recorded("three", 3)), "cable 1").expected_rms
        for robot in (undamped, with_first_cable(undamped, damping_uncertainty=1e8))
    )
    increase = expected_increase(stated(damping_uncertainty=1e8), "cable 1", "tension")
    assert uncertain**2 - exact**2 == pytest.approx(increase, rel=0.05)


@pytest.mark.validate
@pytest.mark.parametrize(
    ("name", "uncertainty", "quantity"),
    [
        ("tension_gain_uncertainty", 0.01, "force z"),
        ("position_offset_uncertainty", 0.5, "force x"),
    ],
)
def test_the_platforms_residual_is_expected_to_hold_what_sensors_are_uncertain_by(
    name: str, uncertainty: float, quantity: str
) -> None:
    change = {
        "tension_gain_uncertainty": lambda number: with_tensions(gain=1.0 + uncertainty, cable=number),
        "tension_offset_uncertainty": lambda number: with_tensions(offset=uncertainty, cable=number),
        "position_offset_uncertainty": lambda number: with_positions(uncertainty, number),
    }[name]
    increase = expected_increase(stated(**{name: uncertainty}), "platform", quantity)
    changed = ((example("three"), change(number)) for number in range(3))
    assert increase == pytest.approx(mean_square_changes("platform", quantity, *changed), rel=0.05)


@pytest.mark.validate
def test_the_platforms_residual_is_expected_to_hold_an_uncertain_exit_point_and_mass() -> None:
    robot, recording = example("three"), recorded("three", 3)
    cable, *others = robot.cables
    cables = (replace(cable, anchor_uncertainty=0.5), *others)
    shifted = []
    for axis in range(3):
        anchor = tuple(value + 0.5 * (axis == number) for number, value in enumerate(cable.anchor))
        shifted.append((replace(robot, cables=(replace(cable, anchor=anchor), *others)), recording))
    increase = expected_increase(replace(robot, cables=cables), "platform", "force x")
    assert increase == pytest.approx(mean_square_changes("platform", "force x", *shifted), rel=0.05)
    mass = replace(robot, platform=replace(robot.platform, mass_uncertainty=2.0))
    heavier = (replace(robot, platform=replace(robot.platform, mass=302.0)), recording)
    # Of the fast accelerations along x smoothing takes a part away.
    for quantity, tolerance in (("force x", 0.25), ("force z", 0.05)):
        changes = mean_square_changes("platform", quantity, heavier)
        assert expected_increase(mass, "platform", quantity) == pytest.approx(changes, rel=tolerance)


@pytest.mark.parametrize(
    ("spread", "mean", "candidates"),
    [
        (20.0, 0.0, ["platform", "load cell 2", "friction before it"]),
        (40.0, 0.0, ["platform", "load cells 1, 2", "friction before them"]),
        (60.0, 0.0, []),
        (20.0, 30.0, []),
    ],
)
def test_load_cells_are_in_question_alone_or_together_where_none_could_show_so_much(
    spread: float, mean: float, candidates: list[str]
) -> None:
    """Along x, at 60 degrees to both cables; up to 2 * 18 N and 2 * 39 N show at none."""

    def part(component: str, quantity: str, rms: float, expected: float, mean: float = 0.0) -> ComponentResidual:
        return ComponentResidual(component, quantity, "N", np.zeros(4), mean, rms, expected, 2.0, None)

    cables = [part("cable 1", "tension", 1.0, 18.0), part("cable 2", "tension", 1.0, 39.0)]
    platform = [part("platform", "force x", float(np.hypot(spread, mean)), 1.0, mean)]
    directions = np.tile([0.5, 0.0, 0.75**0.5], (4, 2, 1))
    assert _load_cell_candidates(cables, platform, directions) == candidates


@pytest.mark.validate
def test_friction_that_uncertain_exit_points_hide_at_its_cable_is_not_put_on_the_platform() -> None:
    hidden = {"friction": {"coefficient": 0.02, "cables": [2]}}
    assert localised(hidden).faulty_component == "load cell 2 or friction before it"
    robot = example("three")
    cables = tuple(replace(cable, anchor_uncertainty=0.1) for cable in robot.cables)
    components = localise(replace(robot, cables=cables), recorded("three", 3, hidden))
    assert not any(part.is_significant for part in components.residuals if part.component != "platform")
    assert components.faulty_component == "platform; load cells 1, 2 or friction before them"


@pytest.mark.validate
def test_a_payload_within_what_load_cells_may_be_off_by_is_no_fault_of_the_platform() -> None:
    robot, recording = example("three"), recorded("three", 3, {"payload": {"mass": 6.0}})
    weight = 6.0 * 9.81
    for gain_uncertainty, component in ((1e-4, "platform"), (weight / 300.0, "nothing")):
        sensors = replace(robot.sensors, tension_gain_uncertainty=gain_uncertainty)
        components = localise(replace(robot, sensors=sensors), recording)
        assert components.faulty_component == component
        assert residual_of(components, "platform", "force z").mean == pytest.approx(-weight, rel=0.02)


@pytest.mark.validate
def test_errors_of_sensors_with_a_memory_are_expected_no_larger_than_their_noise() -> None:
    robot, recording = example("three"), recorded("three", 3)
    white = estimate_noise(robot, recording)

    def expected(tension: float, position: float, component: str, quantity: str) -> float:
        memories = OrnsteinUhlenbeck(position, 1.0), OrnsteinUhlenbeck(tension, 1.0)
        noise = replace(white, disturbance=Disturbance(OrnsteinUhlenbeck(99.0, 1.0), *memories, 1.0, 1.0))
        sample = split_data(robot, noise, recording, recording).estimation
        return residual_of(localise_residual(robot, sample, noise), component, quantity).expected_rms ** 2

    half, noise = 0.5 * white.tension, white.position
    at_cable, without = (expected(size, 0.0, "cable 1", "tension") for size in (half, 0.0))
    assert at_cable - without == pytest.approx(half**2)
    length = np.linalg.norm(np.subtract(robot.cables[0].anchor, robot.platform.start))
    stiffness = robot.cables[0].modulus * robot.cables[0].area / length
    # The path leads some way from the start.
    limited = expected(0.0, 10.0 * noise, "cable 1", "tension") - without
    assert limited == pytest.approx((stiffness * noise) ** 2, rel=0.1)
    on_platform = expected(half, 0.0, "platform", "force z") - expected(0.0, 0.0, "platform", "force z")
    directions = np.subtract(robot.anchors, robot.platform.start)
    squares = (directions[:, 2] / np.linalg.norm(directions, axis=1)) ** 2
    assert on_platform == pytest.approx(half**2 * squares.sum(), rel=0.1)
