"""Which model of the modulus a table asks for.

Modulus and damping, the constant pair of the paper's law, are in every model that describes the rope; only a delay
between the test's channels may stand in the place of damping. Within a family, branches are added as long as the
Bayesian information criterion falls. Of the families without a delay the one with the lowest criterion is taken, and
then loses every term that does not earn its place: chance would improve the fit as much in more than ``alpha`` of
tables that lack it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

from scipy.stats import chi2

from .fit import MaterialFit, fit_terms
from .observations import Observations
from .terms import Hysteresis, Terms, grown

CONSTANT = Terms(damping=True)
LINEAR = Terms(damping=True, branches=1)
# Differences of the criterion from here on are strong evidence (Kass and Raftery 1995).
STRONG = 6.0
# Measured numbers that a model must leave over: one is still left where a row is left out.
SPARE_NUMBERS = 3


@dataclass(frozen=True)
class Selection:
    """The best fit of every family of terms, and the family that is taken."""

    best: Mapping[Terms, MaterialFit]
    chosen: Terms

    @property
    def fit(self) -> MaterialFit:
        """The fit that is taken."""
        return self.best[self.chosen]

    def evidence(self, effect: str) -> float:
        """Natural log of the likelihood ratio to the best model without one effect, other than damping."""
        return 0.5 * (self.best[self.chosen.without(effect)].chi_squared - self.fit.chi_squared)

    def rivals(self, alpha: float) -> tuple[Terms, ...]:
        """Other families that leave no more than noise and that the criterion does not strongly speak against.

        A family that holds all of the chosen one, or of another rival, says nothing new and is not among them.
        """
        able = [
            family
            for family, fit in self.best.items()
            if not family.holds(self.chosen) and fit.p_value >= alpha and fit.bic < self.fit.bic + STRONG
        ]
        least = [family for family in able if not any(family.holds(other) for other in able if other != family)]
        return tuple(sorted(least, key=lambda family: self.best[family].bic))


def select(seen: Observations, alpha: float, tell: Callable[[str, float], None] = lambda what, done: None) -> Selection:
    """Fits every family of terms and chooses one; ``tell`` hears what is being tried and how far it has come."""
    best: dict[Terms, MaterialFit] = {}
    families = _families(seen)
    for place, family in enumerate(families):
        tell(f"fitting {family.label}", place / len(families))
        plain, *branched = _fits(seen, family)
        best[family] = plain
        if branched:
            best[branched[0].terms.family] = min(branched, key=lambda fit: fit.bic)
    ours = [family for family in best if not family.delay]
    chosen = min(ours, key=lambda family: best[family].bic)
    return Selection(best, _earned(seen, best, chosen, alpha))


def best_linear(seen: Observations) -> MaterialFit:
    """The best fit of damping and relaxation alone, which is what robot files can hold."""
    return min(_fits(seen, CONSTANT)[1:], key=lambda fit: fit.bic)


def chance(fit: MaterialFit, without: MaterialFit) -> float:
    """How often chance improves a fit as much as the terms do that ``without`` lacks (likelihood ratio test)."""
    gain, added = without.chi_squared - fit.chi_squared, len(fit.values) - len(without.values)
    return float(chi2.sf(max(gain, 0.0), added))


def _families(seen: Observations) -> tuple[Terms, ...]:
    """All terms without branches that are tried."""
    kinds: tuple[Hysteresis, ...] = ("none", "modulus", "stress") if seen.has_amplitude else ("none", "modulus")
    choices = product((False, True), kinds, (False, True))
    return tuple(
        Terms(damping=damping, hysteresis=kind, delay=delay) for delay, kind, damping in choices if delay or damping
    )


def _fits(seen: Observations, family: Terms) -> list[MaterialFit]:
    """A family without branches, then with one, two ... until the criterion rises; the last may be the worse one."""
    fits: list[MaterialFit] = []
    for terms in grown(family, seen.number_count - SPARE_NUMBERS):
        fits.append(fit_terms(seen, terms))
        if terms.branches > 1 and fits[-1].bic > fits[-2].bic:
            break
    return fits


def _earned(seen: Observations, best: Mapping[Terms, MaterialFit], chosen: Terms, alpha: float) -> Terms:
    while True:
        fit = best[chosen]
        # With as many branches the smaller model lies inside the larger, as the test needs it.
        chances = {
            effect: chance(fit, fit_terms(seen, fit.terms.without(effect))) for effect in chosen.effects - {"damping"}
        }
        weakest = max(chances, key=lambda effect: chances[effect], default=None)
        if weakest is None or chances[weakest] < alpha:
            return chosen
        chosen = chosen.without(weakest)
