"""Which prospects are worth a fit, and which of the fitted is the simplest."""

from __future__ import annotations

import numpy as np

from tautwire.tracer.fit import Fit
from tautwire.tracer.hypotheses import Hypothesis
from tautwire.tracer.screen import Prospect
from tautwire.tracer.trials import ALIKE, MOST_FITTED, MOST_OF_AN_EFFECT, Trial, simplest, worth_fitting
from tautwire_fmu.laws.effects import ALL, BY_NAME
from tests.robots import example

ROBOT = example("three")
ONE_OF_EACH = [Hypothesis(effect, (1,)) for effect in ALL]


def promised(ranked: list[Hypothesis], best: float = 100.0) -> dict[Hypothesis, Prospect]:
    """Prospects that gain less, the later they are in the list."""
    return {hypothesis: Prospect(best - place, {}) for place, hypothesis in enumerate(ranked)}


def test_the_best_are_fitted_and_no_more() -> None:
    assert worth_fitting(promised(ONE_OF_EACH)) == ONE_OF_EACH[:MOST_FITTED]


def test_no_effect_takes_all_places() -> None:
    damping = [Hypothesis(BY_NAME["damping"], (cable,)) for cable in (1, 2, 3)]
    damping.append(Hypothesis(BY_NAME["damping"], (1, 2, 3)))
    worth = worth_fitting(promised([*damping, Hypothesis(BY_NAME["payload"], ())]))
    assert worth == [*damping[:MOST_OF_AN_EFFECT], Hypothesis(BY_NAME["payload"], ())]


def test_what_promises_next_to_nothing_is_not_fitted() -> None:
    first, second, third = ONE_OF_EACH[:3]
    assert worth_fitting({first: Prospect(1e4, {}), second: Prospect(100.0, {}), third: Prospect(300.0, {})}) == [
        first,
        third,
    ]
    assert worth_fitting({first: Prospect(3.0, {})}) == []


def test_another_look_puts_its_best_in_the_place_of_the_last() -> None:
    beside = [*reversed(ONE_OF_EACH)]
    worth = worth_fitting(promised(ONE_OF_EACH), promised(beside))
    assert len(worth) == MOST_FITTED
    assert worth == [*ONE_OF_EACH[: MOST_FITTED - 3], *beside[:3]]


def test_another_look_at_the_same_changes_nothing() -> None:
    assert worth_fitting(promised(ONE_OF_EACH), promised(ONE_OF_EACH)) == ONE_OF_EACH[:MOST_FITTED]


def test_of_those_alike_the_one_with_fewest_parameters_is_simplest() -> None:
    fit = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    relaxation, damping = (Hypothesis(BY_NAME[name], (1,)) for name in ("relaxation", "damping"))
    better = Trial(relaxation, fit, 100.0, 1.0)
    assert simplest([better, Trial(damping, fit, 100.0 - 0.5 * ALIKE, 1.0)]).hypothesis is damping  # type: ignore[union-attr]
    assert simplest([better, Trial(damping, fit, 100.0 - 2.0 * ALIKE, 1.0)]) is better
    assert simplest([]) is None
