"""Constants of a rigid body with effects, against a cloud of mass points of which each moment is a sum."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rigid_body import principal_axes
from tautwire_fmu.laws.rigid_body_effects import BodyConstants, constants_with_effects

Array = NDArray[np.float64]

RANDOM = np.random.default_rng(7)
MASSES, POINTS = RANDOM.uniform(1.0, 5.0, 6), RANDOM.normal(size=(6, 3))
ATTACHMENTS = ((0.5, 0.4, 0.1), (-0.5, 0.2, 0.0))


def inertia_about(centre: Array, masses: Array, points: Array) -> Array:
    """Inertia of mass points."""
    arms = points - centre
    sums: Array = np.einsum("k,kij->ij", masses, np.sum(arms**2, axis=1)[:, None, None] * np.eye(3))
    return sums - np.einsum("k,ki,kj->ij", masses, arms, arms)


def body_of(masses: Array, points: Array) -> BodyConstants:
    centre = masses @ points / masses.sum()
    x, y, z = map(tuple, inertia_about(centre, masses, points).tolist())
    return BodyConstants(float(masses.sum()), (x, y, z), principal_axes((x, y, z)), tuple(centre), ATTACHMENTS)


def active(name: str, **values: float) -> ActiveEffect:
    effect = BY_NAME[name]
    return ActiveEffect(effect, effect.values(**effect.completed_values(values)))


BODY = body_of(MASSES, POINTS)


@pytest.mark.parametrize("mass", [7.0, -3.0])
def test_a_payload_is_one_more_mass_point(mass: float) -> None:
    place = np.add(BODY.centre_of_mass, [0.3, -0.2, 0.5])
    loaded = constants_with_effects(REAL, BODY, [active("payload", mass=mass, x=0.3, y=-0.2, z=0.5)], [(), ()])
    expected = body_of(np.append(MASSES, mass), np.vstack([POINTS, place]))
    assert loaded.mass == pytest.approx(expected.mass)
    assert loaded.centre_of_mass == pytest.approx(expected.centre_of_mass, rel=1e-13)
    assert np.array(loaded.inertia) == pytest.approx(np.array(expected.inertia), rel=1e-12)


def test_a_payload_without_position_sits_at_the_true_centre_of_mass() -> None:
    effects = [active("payload", mass=7.0), active("centre_of_mass", x=0.1, y=-0.2, z=0.05)]
    loaded = constants_with_effects(REAL, BODY, effects, [(), ()])
    assert loaded.centre_of_mass == pytest.approx(np.add(BODY.centre_of_mass, [0.1, -0.2, 0.05]))
    assert np.array(loaded.inertia) == pytest.approx(np.array(BODY.inertia))


def test_factors_multiply_the_principal_moments_and_keep_the_axes() -> None:
    factors = np.array([1.3, 0.8, 1.1])
    effect = active("inertia", **dict(zip(("factor_x", "factor_y", "factor_z"), factors.tolist(), strict=True)))
    changed = np.array(constants_with_effects(REAL, BODY, [effect], [(), ()]).inertia)
    axes = np.array(BODY.principal_axes)
    moments = np.diag(axes @ np.array(BODY.inertia) @ axes.T)
    assert axes @ changed @ axes.T == pytest.approx(np.diag(factors * moments), abs=1e-12)


def test_an_attachment_is_shifted_for_its_cable_alone() -> None:
    shift = active("attachment", x=0.01, z=-0.02)
    changed = constants_with_effects(REAL, BODY, [shift], [(), (shift,)])
    assert changed.attachments[0] == ATTACHMENTS[0]
    assert changed.attachments[1] == pytest.approx((-0.49, 0.2, -0.02))
    assert changed._replace(attachments=ATTACHMENTS) == BODY
