import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import minimize

from tautwire.errors import ArgumentError
from tautwire.robot.schema import TensionLimits
from tautwire.robot.tension_distribution import RULES, distribute_by_rule, distribute_tensions, least_limit_violations

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


def redundant(count: int, level: float) -> tuple[np.ndarray, np.ndarray]:
    """A structure matrix of six rows, and a load that ``level`` newtons in each of its cables balance."""
    matrix = np.random.default_rng(count).normal(size=(6, count))
    matrix[0] = np.abs(matrix[0])
    return matrix, matrix @ np.full(count, level)


LIMITS = TensionLimits(100.0, 1000.0, 300.0)


@pytest.mark.parametrize("count", (7, 8, 9))
def test_the_barycentre_is_the_mean_of_the_feasible_tensions(count: int) -> None:
    matrix, load = redundant(count, 400.0)
    tensions = distribute_by_rule(matrix, load, LIMITS, "barycentre")
    assert tensions is not None
    basis = null_space(matrix)
    draws = np.random.default_rng(0).uniform(-1500.0, 1500.0, size=(400_000, count - 6))
    samples = np.full(count, 400.0) + draws @ basis.T
    feasible = samples[np.all((samples >= LIMITS.minimum) & (samples <= LIMITS.maximum), axis=1)]
    assert len(feasible) > 500
    error = 4.0 * feasible.std(axis=0) / np.sqrt(len(feasible)) + 0.01
    assert np.all(np.abs(tensions - feasible.mean(axis=0)) < error)
    assert np.allclose(matrix @ tensions, load)


def test_the_least_norm_within_bounds_is_that_of_a_plain_optimiser() -> None:
    matrix, load = redundant(8, 250.0)
    tensions = distribute_by_rule(matrix, load, LIMITS, "least_norm")
    plain = minimize(
        lambda x: float(x @ x) / 1e4,
        np.full(8, 250.0),
        bounds=[(100.0, 1000.0)] * 8,
        constraints={"type": "eq", "fun": lambda x: (matrix @ x - load) / 1e2},
        options={"maxiter": 500, "ftol": 1e-14},
    )
    assert tensions == pytest.approx(plain.x, rel=1e-4)


def test_the_closed_form_is_nearest_to_the_middle_and_keeps_the_bounds_where_that_breaks_them() -> None:
    matrix, load = redundant(8, 500.0)
    middle = 550.0 + np.linalg.pinv(matrix) @ (load - 550.0 * matrix.sum(axis=1))
    assert distribute_by_rule(matrix, load, LIMITS, "closed_form") == pytest.approx(middle)
    at_bounds = 0
    for seed in range(20):
        wanted = np.random.default_rng(seed).uniform(100.0, 1000.0, 8)
        tensions = distribute_by_rule(matrix, matrix @ wanted, LIMITS, "closed_form")
        if tensions is not None:
            at_bounds += bool(np.any((tensions == 100.0) | (tensions == 1000.0)))
            assert np.allclose(matrix @ tensions, matrix @ wanted, rtol=1e-6, atol=1e-3)
            assert np.all((tensions >= 100.0) & (tensions <= 1000.0))
    assert at_bounds >= 3


@pytest.mark.parametrize("count", (3, 4, 5, 6))
@pytest.mark.parametrize("rule", RULES)
def test_every_rule_gives_the_only_tensions_of_few_cables(rule: str, count: int) -> None:
    draws = np.random.default_rng(count)
    matrix, wanted = draws.normal(size=(6, count)), draws.uniform(120.0, 900.0, count)
    found = distribute_by_rule(matrix, matrix @ wanted, LIMITS, rule)
    assert found == pytest.approx(wanted, rel=1e-9)
    unlimited = distribute_by_rule(matrix, matrix @ wanted, TensionLimits(0.0, float("inf"), 0.0), rule)
    assert unlimited == pytest.approx(wanted, rel=1e-9)
    assert distribute_by_rule(matrix, 9.0 * matrix @ wanted, LIMITS, rule) is None
    if count < 6:
        beside = null_space(matrix.T)[:, 0]
        assert distribute_by_rule(matrix, matrix @ wanted + 50.0 * beside, LIMITS, rule) is None


@pytest.mark.parametrize("rule", RULES)
def test_a_dependent_row_changes_no_distribution(rule: str) -> None:
    """Four cables of a point, one of which the bounds hold: five rows of rank three."""
    matrix = np.random.default_rng(3).normal(size=(3, 4))
    load = matrix @ np.array([120.0, 900.0, 150.0, 800.0])
    combined = np.vstack([matrix, matrix.sum(axis=0), matrix[0] - matrix[2]])
    alone = distribute_by_rule(matrix, load, LIMITS, rule)
    assert alone is not None and matrix @ alone == pytest.approx(load)
    both = distribute_by_rule(combined, np.array([*load, load.sum(), load[0] - load[2]]), LIMITS, rule)
    assert both == pytest.approx(alone, rel=1e-6)
    if rule == "closed_form":
        assert np.any((alone == LIMITS.minimum) | (alone == LIMITS.maximum))


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_tells_that_no_tensions_are_feasible(rule: str) -> None:
    matrix, load = redundant(8, 5000.0)
    matrix, load = np.abs(matrix), np.abs(matrix) @ np.full(8, 5000.0)
    assert distribute_by_rule(matrix, load, LIMITS, rule) is None


def test_unknown_rules_and_missing_maxima_are_refused() -> None:
    matrix, load = redundant(8, 400.0)
    with pytest.raises(ArgumentError, match="barycentre"):
        distribute_by_rule(matrix, load, LIMITS, "barycenter")
    with pytest.raises(ArgumentError, match="needs a maximum tension"):
        distribute_by_rule(matrix, load, TensionLimits(0.0, float("inf"), 0.0), "closed_form")
