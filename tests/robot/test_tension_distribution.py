import numpy as np
import pytest
from scipy.optimize import minimize

from tautwire.robot.schema import TensionLimits
from tautwire.robot.tension_distribution import distribute_tensions, least_limit_violations

DRAWS = np.random.default_rng(7)
SKETCHES = [DRAWS.normal(size=(3, int(count))) for count in (4, 5, 6, 8)]


def unit_of(sketch: np.ndarray) -> np.ndarray:
    unit = sketch / np.linalg.norm(sketch, axis=0)
    unit[2] = np.abs(unit[2])
    return unit


@pytest.mark.parametrize("sketch", SKETCHES, ids=len)
@pytest.mark.parametrize("maximum", [3000.0, float("inf")])
def test_the_least_breach_of_limits_is_that_of_a_plain_optimiser(sketch: np.ndarray, maximum: float) -> None:
    unit, load = unit_of(sketch), np.array([4000.0, -2000.0, 1000.0])
    limits, count = TensionLimits(50.0, maximum, 500.0), sketch.shape[1]
    result = least_limit_violations(unit, load, limits)
    other = minimize(
        lambda x: float(np.sum(x[count:] ** 2)) / 1e6,
        np.concatenate([np.full(count, 500.0), np.zeros(count)]),
        bounds=[(50.0, min(maximum, 1e6))] * count + [(None, None)] * count,
        constraints={"type": "eq", "fun": lambda x: (unit @ (x[:count] + x[count:]) - load) / 1e3},
        options={"maxiter": 2000, "ftol": 1e-14},
    )
    assert np.sum(result**2) / 1e6 == pytest.approx(other.fun, rel=1e-3, abs=1e-6)
    # With what is missing given, the limits do.
    assert distribute_tensions(unit, load - unit @ result, limits) is not None
    assert (distribute_tensions(unit, load, limits) is None) == (np.max(np.abs(result)) > 1e-6)


def test_what_cables_can_hold_breaks_no_limit() -> None:
    unit, limits = unit_of(SKETCHES[2]), TensionLimits(10.0, 5000.0, 300.0)
    load = unit @ np.full(6, 700.0)
    assert least_limit_violations(unit, load, limits) == pytest.approx(np.zeros(6), abs=1e-6)
    tensions = distribute_tensions(unit, load, limits)
    assert tensions is not None and unit @ tensions == pytest.approx(load)


def test_cables_in_a_plane_cannot_make_a_force_out_of_it() -> None:
    unit = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0], [0.0, 0.0, 0.0, 0.0]])
    limits = TensionLimits(0.0, float("inf"), 0.0)
    assert np.all(np.isnan(least_limit_violations(unit, np.array([0.0, 0.0, 100.0]), limits)))
    assert least_limit_violations(unit, np.array([30.0, 0.0, 0.0]), limits) == pytest.approx(np.zeros(4), abs=1e-9)
