"""Static equilibrium of rigid platforms, against closed forms, an energy minimum and SciPy's optimisation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog, minimize
from scipy.spatial.transform import Rotation

from tautwire.errors import UnreachableError
from tautwire.robot import rigid_equilibrium
from tautwire.robot.cable_routes import attachment_points
from tautwire.robot.kinematics import structure_matrix
from tautwire.robot.rigid_equilibrium import load_wrench, static_equilibrium
from tautwire.robot.schema import EffectSetting, Point, Robot, TensionLimits
from tautwire.robot.static_equilibrium import start_attachments, start_orientation, static_forces, static_tensions
from tests.support.rigid_robots import cable, crane_robot, octahedral_robot, suspended_robot


def shifted(robot: Robot, centre_of_mass: Point, turn: Point = (0.0, 0.0, 0.0)) -> Robot:
    """The robot with another centre of mass and declared orientation."""
    x, y, z, w = Rotation.from_rotvec(turn).as_quat().tolist()
    platform = replace(robot.platform, centre_of_mass=centre_of_mass, start_orientation=(w, x, y, z))
    return replace(robot, platform=platform)


def rotation(quaternion: tuple[float, ...]) -> Rotation:
    """SciPy's rotation of a quaternion, scalar first."""
    w, x, y, z = quaternion
    return Rotation.from_quat((x, y, z, w))


def imbalance(robot: Robot, orientation: tuple[float, ...], tensions: np.ndarray) -> np.ndarray:
    """Force and moment about the centre of mass, independent of the structure matrix."""
    turn, start = rotation(orientation), np.array(robot.platform.start)
    centre = start + turn.apply(robot.platform.centre_of_mass)
    force, moment = np.array([0.0, 0.0, -robot.platform.mass * robot.gravity]), np.zeros(3)
    for each, tension in zip(robot.cables, tensions, strict=True):
        end = start + turn.apply(each.attachment)
        pull = tension * (np.array(each.anchor) - end) / np.linalg.norm(np.array(each.anchor) - end)
        force, moment = force + pull, moment + np.cross(end - centre, pull)
    return np.concatenate([force, moment])


@pytest.mark.parametrize("count", (2, 3, 4, 5, 6))
def test_cables_in_a_ring_share_the_weight_of_a_platform_that_hangs_level(count: int) -> None:
    robot = suspended_robot(count)
    equilibrium = static_equilibrium(robot)
    # From the attachments at 0.4 m and 1.7 m to the anchors at 4 m and 5 m.
    inclination = 3.3 / np.hypot(3.6, 3.3)
    expected = robot.platform.mass * robot.gravity / count / inclination
    assert equilibrium.tensions == pytest.approx([expected] * count, rel=1e-9)
    assert equilibrium.moved_by == 0.0
    assert equilibrium.orientation == robot.platform.start_orientation


def test_six_cables_carry_the_only_tensions() -> None:
    robot = shifted(octahedral_robot(), (0.03, -0.02, 0.1), (0.05, 0.02, 0.1))
    equilibrium = static_equilibrium(robot)
    assert np.allclose(imbalance(robot, equilibrium.orientation, equilibrium.tensions), 0.0, atol=1e-8)
    matrix, load = structure_matrix(robot), load_wrench(robot, np.array(robot.platform.start), equilibrium.orientation)
    assert np.allclose(equilibrium.tensions, np.linalg.solve(matrix, load))
    assert equilibrium.moved_by == 0.0


@pytest.mark.validate(only=["4"])
@pytest.mark.parametrize("count", (3, 4, 5))
def test_fewer_cables_turn_the_platform_into_the_nearest_equilibrium(count: int) -> None:
    robot = shifted(suspended_robot(count), (0.05, 0.02, -0.1), (0.05, 0.08, 0.03))
    equilibrium = static_equilibrium(robot)
    assert np.allclose(imbalance(robot, equilibrium.orientation, equilibrium.tensions), 0.0, atol=2e-6)
    assert np.min(equilibrium.tensions) >= 0.0
    turned = rotation(equilibrium.orientation) * rotation(robot.platform.start_orientation).inv()
    assert equilibrium.moved_by == pytest.approx(turned.magnitude(), rel=1e-6)
    assert 0.01 < equilibrium.moved_by < 0.2

    def residual(variables: np.ndarray) -> np.ndarray:
        x, y, z, w = (Rotation.from_rotvec(variables[:3]) * rotation(robot.platform.start_orientation)).as_quat()
        return imbalance(robot, (w, x, y, z), 100.0 * variables[3:]) / 100.0

    guess = np.concatenate([turned.as_rotvec() + 0.01, equilibrium.tensions / 100.0])
    nearest = minimize(
        lambda variables: variables[:3] @ variables[:3],
        guess,
        constraints={"type": "eq", "fun": residual},
        bounds=[(None, None)] * 3 + [(0.0, None)] * count,
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 60},
    )
    assert np.linalg.norm(nearest.x[:3]) == pytest.approx(equilibrium.moved_by, rel=1e-4)


def test_the_same_robot_is_searched_once(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, searches = shifted(suspended_robot(3), (0.021, 0.013, -0.1)), []
    search = rigid_equilibrium._searched
    monkeypatch.setattr(rigid_equilibrium, "_searched", lambda *given: searches.append(given) or search(*given))
    orientation, tensions = start_orientation(robot), static_tensions(robot)
    assert len(searches) == 1
    assert np.allclose(imbalance(robot, orientation, tensions), 0.0, atol=2e-6)


def test_with_three_cables_it_is_where_the_potential_energy_cannot_fall() -> None:
    robot = shifted(suspended_robot(3), (0.05, 0.02, -0.1))
    equilibrium = static_equilibrium(robot)
    start, mass = np.array(robot.platform.start), robot.platform.mass
    ends = np.array(start_attachments(robot))
    lengths = np.linalg.norm(np.array(robot.anchors) - ends, axis=1)

    def stretch(pose: np.ndarray) -> np.ndarray:
        turned = pose[:3] + (Rotation.from_rotvec(pose[3:]) * rotation(equilibrium.orientation)).apply(
            robot.attachments
        )
        return np.linalg.norm(np.array(robot.anchors) - turned, axis=1) - lengths

    def height(pose: np.ndarray) -> float:
        turn = Rotation.from_rotvec(pose[3:]) * rotation(equilibrium.orientation)
        return float(
            mass * robot.gravity * (pose + np.concatenate([turn.apply(robot.platform.centre_of_mass), [0.0] * 3]))[2]
        )

    hanging = minimize(
        height,
        np.concatenate([start, np.zeros(3)]),
        constraints={"type": "eq", "fun": stretch},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 300},
    )
    assert np.allclose(hanging.x, [*start, 0.0, 0.0, 0.0], atol=1e-5)


def test_an_equilibrium_orientation_stays_where_it_is() -> None:
    robot = shifted(suspended_robot(4), (0.05, 0.02, -0.1))
    orientation = start_orientation(robot)
    again = replace(robot, platform=replace(robot.platform, start_orientation=orientation))
    equilibrium = static_equilibrium(again)
    assert (equilibrium.orientation, equilibrium.moved_by) == (orientation, 0.0)


def test_the_minimum_tension_keeps_spare_cables_taut() -> None:
    robot = shifted(suspended_robot(5), (0.05, 0.02, -0.1), (0.05, 0.08, 0.03))
    assert np.min(static_equilibrium(robot).tensions) < 1.0
    taut = static_equilibrium(replace(robot, tension=TensionLimits(30.0, 1000.0, 200.0)))
    assert np.min(taut.tensions) >= 30.0 - 1e-6
    assert np.allclose(imbalance(robot, taut.orientation, taut.tensions), 0.0, atol=2e-6)


def test_two_cables_hold_a_platform_in_their_plane_only_and_the_error_tells_the_nearest_place() -> None:
    aside = suspended_robot(2)
    aside = replace(aside, platform=replace(aside.platform, start=(0.1, 0.05, 1.5)))
    with pytest.raises(UnreachableError, match="2 cables balance no orientation") as caught:
        static_equilibrium(aside)
    x, y, z = (float(part) for part in caught.value.hint.partition("[")[2].partition("]")[0].split(", "))
    assert abs(y) < 1e-9
    near = static_equilibrium(aside, (x, 0.0, z))
    assert near.moved_by < 0.2 and near.residual_force < 1e-6


def test_two_cables_hold_a_surveyed_place_that_is_nearly_in_their_plane_and_tell_what_remains() -> None:
    robot = suspended_robot(2)
    surveyed = replace(robot, platform=replace(robot.platform, start=(0.0, 3e-4, 1.5)))
    equilibrium = static_equilibrium(surveyed)
    remaining = imbalance(surveyed, equilibrium.orientation, equilibrium.tensions)
    assert 1e-3 < equilibrium.residual_force < 0.2
    assert np.linalg.norm(remaining[:3]) == pytest.approx(equilibrium.residual_force, rel=1e-6)
    assert np.allclose(equilibrium.tensions, static_tensions(robot), rtol=1e-3)


@pytest.mark.parametrize("robot", (crane_robot(), shifted(crane_robot(), (0.1, 0.0, 0.3), (0.0, 0.1, 0.1))))
def test_eight_cables_carry_the_feasible_tensions_nearest_to_the_preferred(robot: Robot) -> None:
    equilibrium, limits = static_equilibrium(robot), robot.tension
    assert limits is not None
    assert np.allclose(imbalance(robot, equilibrium.orientation, equilibrium.tensions), 0.0, atol=1e-5)
    matrix, load = structure_matrix(robot), load_wrench(robot, np.array(robot.platform.start), equilibrium.orientation)
    nearest = minimize(
        lambda tensions: np.sum((tensions / 600.0 - 1.0) ** 2),
        np.full(8, 400.0),
        constraints={"type": "eq", "fun": lambda tensions: (matrix @ tensions - load) / 100.0},
        bounds=[(limits.minimum, limits.maximum)] * 8,
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 300},
    )
    assert np.allclose(equilibrium.tensions, nearest.x, rtol=1e-4)


def test_what_breaks_a_bound_is_refused_with_bound_and_cable() -> None:
    crane = replace(crane_robot(), tension=TensionLimits(20.0, 200.0, 100.0))
    with pytest.raises(UnreachableError, match="no tensions between 20 and 200 N hold") as caught:
        static_equilibrium(crane)
    assert caught.value.cable is not None and caught.value.tension is not None and caught.value.tension > 200.0


@pytest.mark.parametrize("rule", ("barycentre", "closed_form"))
def test_rules_that_need_bounds_take_them_from_the_robot_file_whatever_the_number_of_cables(rule: str) -> None:
    """Four cables of a ring have a self-stress where they hang level, by which neighbours differ."""
    robot = replace(suspended_robot(4), tension=TensionLimits(50.0, 900.0, 300.0))
    assert static_equilibrium(robot, rule=rule).tensions == pytest.approx(static_tensions(robot))
    with pytest.raises(UnreachableError, match="no tensions between 300 and 900 N hold the platform there"):
        static_equilibrium(replace(robot, tension=TensionLimits(300.0, 900.0, 400.0)), rule=rule)


def test_a_weight_that_pulling_cables_cannot_balance_is_refused_for_want_of_wrench_closure() -> None:
    robot = shifted(crane_robot(), (2.5, 0.0, 0.26))
    matrix, load = structure_matrix(robot), load_wrench(robot, np.array(robot.platform.start), (1.0, 0.0, 0.0, 0.0))
    assert not linprog(np.zeros(8), A_eq=matrix, b_eq=load, bounds=[(0.0, None)] * 8).success
    with pytest.raises(UnreachableError, match="no wrench closure, as no tensions that only pull") as caught:
        static_equilibrium(robot)
    assert caught.value.cable is not None


def test_six_cables_that_meet_on_an_axis_exert_no_moment_about_it() -> None:
    with pytest.raises(UnreachableError, match=r"exert wrenches of rank 3 only: .* N m of the load remain"):
        static_equilibrium(shifted(suspended_robot(6), (0.05, 0.0, 0.0)))


def test_a_cable_that_would_push_is_named() -> None:
    robot = octahedral_robot()
    with pytest.raises(UnreachableError, match=r"a cable cannot push, cable [1-6] would need -"):
        static_equilibrium(shifted(robot, (0.9, 0.0, 0.0)))
    hanging = suspended_robot(3)
    above = replace(hanging, platform=replace(hanging.platform, start=(0.0, 0.0, 6.0)))
    with pytest.raises(UnreachableError):
        static_equilibrium(above)


def test_statics_of_the_start_are_those_of_the_equilibrium() -> None:
    robot = shifted(suspended_robot(4), (0.05, 0.02, -0.1))
    equilibrium = static_equilibrium(robot)
    assert np.array_equal(static_tensions(robot), equilibrium.tensions)
    assert start_orientation(robot) == equilibrium.orientation
    assert start_attachments(robot) == attachment_points(robot, robot.platform.start, equilibrium.orientation)
    forces = static_forces(robot)
    assert np.allclose(forces.sum(axis=0), [0.0, 0.0, robot.platform.mass * robot.gravity], atol=1e-6)
    arms = np.array(start_attachments(robot)) - robot.platform.start
    weight_arm = rotation(equilibrium.orientation).apply(robot.platform.centre_of_mass)
    weight = [0.0, 0.0, robot.platform.mass * robot.gravity]
    assert np.allclose(np.cross(arms, forces).sum(axis=0), np.cross(weight_arm, weight), atol=1e-6)


@pytest.mark.parametrize("robot", (suspended_robot(4), crane_robot()), ids=("four", "crane"))
def test_the_weight_of_cables_and_a_payload_count(robot: Robot) -> None:
    robot = shifted(robot, (0.02, 0.01, -0.1))
    heavy = robot.with_effect(EffectSetting("sag", {"linear_density": 0.1}, robot.cable_numbers))
    heavy = heavy.with_effect(EffectSetting("payload", {"mass": 5.0}))
    equilibrium = static_equilibrium(heavy)
    load = load_wrench(heavy, np.array(heavy.platform.start), equilibrium.orientation, equilibrium.tensions)
    matrix = structure_matrix(heavy, None, equilibrium.orientation)
    assert np.allclose(matrix @ equilibrium.tensions, load, atol=1e-5)
    assert load[2] > (heavy.platform.mass + 5.0) * heavy.gravity + 4.0


def test_attachments_at_the_origin_are_a_point_mass() -> None:
    anchors: list[Point] = [(4.0, 0.0, 5.0), (-2.0, 3.0, 5.0), (-2.0, -3.0, 5.5)]
    rigid = replace(suspended_robot(3), cables=tuple(cable(anchor, (0.0, 0.0, 0.0)) for anchor in anchors))
    rigid = shifted(rigid, (0.0, 0.0, 0.0))
    point = replace(rigid, platform=replace(rigid.platform, inertia=None))
    assert np.allclose(static_tensions(rigid), static_tensions(point), rtol=1e-12)


def test_an_orientation_of_the_callers_is_held_as_a_declared_one_would_be() -> None:
    turned = shifted(crane_robot(), crane_robot().platform.centre_of_mass, (0.05, -0.08, 0.2))
    declared = static_equilibrium(turned)
    asked = static_equilibrium(crane_robot(), orientation=turned.platform.start_orientation)
    assert asked.orientation == declared.orientation and asked.moved_by == 0.0
    assert np.array_equal(asked.tensions, declared.tensions)
    assert np.linalg.norm(imbalance(crane_robot(), asked.orientation, asked.tensions)) < 1e-6
