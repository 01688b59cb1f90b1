"""The same models where the table's errors are read in another way: does the verdict hang on it?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from .fit import fit_terms
from .observations import Observations, observations
from .table import MaterialTable
from .terms import Terms
from .verdict import Assumption, Role

SHARED, TWO_SIGMA = 0.5, 2.0


def assumptions(
    table: MaterialTable, pair: tuple[str, str], shared: float, coverage: float, terms: Mapping[Role, Terms]
) -> tuple[Assumption, ...]:
    """Chi-squared, degrees of freedom and p value of each model under each reading, the one in use first."""
    return tuple(
        Assumption(label, {role: _outcome(seen, each) for role, each in terms.items()})
        for label, seen in _readings(table, pair, shared, coverage)
    )


def _outcome(seen: Observations, terms: Terms) -> tuple[float, int, float]:
    fit = fit_terms(seen, terms)
    return fit.chi_squared, fit.freedom, fit.p_value


def _readings(
    table: MaterialTable, pair: tuple[str, str], shared: float, coverage: float
) -> Iterator[tuple[str, Observations]]:
    yield "as fitted", observations(table, pair, shared, coverage)
    for other in table.pairs():
        if other != pair:
            yield f"from {other[0]} and {other[1]}", observations(table, other, shared, coverage)
    for share in (0.0, SHARED):
        if share != shared:
            label = f"{share:.0%} of each variance common to all rows"
            yield label, observations(table, pair, share, coverage)
    if coverage != TWO_SIGMA:
        yield "uncertainties are two standard deviations", observations(table, pair, shared, TWO_SIGMA)
    if table.static:
        yield "static rows fitted too", observations(table, pair, shared, coverage).with_static(table)
