import pytest

from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, acceleration, total_mass

ORIGIN = (0.0, 0.0, 0.0)
PLATFORM = PointMassConstants(mass=80.0, gravity=9.81)


def test_it_falls_without_cables() -> None:
    assert acceleration(REAL, PLATFORM, (), (), ORIGIN) == (0.0, 0.0, -9.81)


def test_its_weight_holds_it_at_rest() -> None:
    held = acceleration(REAL, PLATFORM, (), (), (0.0, 0.0, 80.0 * 9.81))
    assert held == pytest.approx(ORIGIN, abs=1e-14)


def test_a_payload_weighs_and_resists_acceleration() -> None:
    carried = (ActiveEffect(BY_NAME["payload"], BY_NAME["payload"].values(20.0)),)
    assert total_mass(REAL, PLATFORM, carried) == 100.0
    moved = acceleration(REAL, PLATFORM, carried, ((),), (50.0, 0.0, 100.0 * 9.81))
    assert moved == pytest.approx((0.5, 0.0, 0.0), abs=1e-14)
