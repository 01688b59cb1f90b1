"""Sensitivity of the verdict to how the table's errors are read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from .fit import fit_structure
from .observations import ModulusObservations, observations_from_table
from .table import MaterialTable
from .terms import ModelStructure
from .verdict import ErrorAssumption, Role

ASSUMED_SHARED_VARIANCE, TWO_SIGMA_COVERAGE = 0.5, 2.0


def error_assumptions(
    table: MaterialTable,
    pair: tuple[str, str],
    shared_variance: float,
    coverage_factor: float,
    structures: Mapping[Role, ModelStructure],
) -> tuple[ErrorAssumption, ...]:
    """Chi-squared, degrees of freedom and p value of each model under each reading of the errors, that in use first."""
    return tuple(
        ErrorAssumption(label, {role: _fit_outcome(observations, each) for role, each in structures.items()})
        for label, observations in _error_readings(table, pair, shared_variance, coverage_factor)
    )


def _fit_outcome(observations: ModulusObservations, structure: ModelStructure) -> tuple[float, int, float]:
    fit = fit_structure(observations, structure)
    return fit.chi_squared, fit.degrees_of_freedom, fit.p_value


def _error_readings(
    table: MaterialTable, pair: tuple[str, str], shared_variance: float, coverage_factor: float
) -> Iterator[tuple[str, ModulusObservations]]:
    yield "as fitted", observations_from_table(table, pair, shared_variance, coverage_factor)
    for other in table.modulus_pairs():
        if other != pair:
            yield (
                f"from {other[0]} and {other[1]}",
                observations_from_table(table, other, shared_variance, coverage_factor),
            )
    for assumed_share in (0.0, ASSUMED_SHARED_VARIANCE):
        if assumed_share != shared_variance:
            label = f"{assumed_share:.0%} of each variance common to all rows"
            yield label, observations_from_table(table, pair, assumed_share, coverage_factor)
    if coverage_factor != TWO_SIGMA_COVERAGE:
        yield (
            "uncertainties are two standard deviations",
            observations_from_table(table, pair, shared_variance, TWO_SIGMA_COVERAGE),
        )
    if table.static_rows:
        yield (
            "static rows fitted too",
            observations_from_table(table, pair, shared_variance, coverage_factor).with_static_rows(table),
        )
