"""Formulas of selected terms: with named free parameters, or with numbers rounded to their uncertainty."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import floor, isfinite, log10

from tautwire_fmu.laws.formula import VARIABLES_BY_TARGET

from ...robots.robot import EffectSetting, Formula, Robot
from .library import SHAPE_PARAMETER, Term
from .ports import Site

# Digits of a number beyond the first of its standard deviation.
EXTRA_DIGITS = 1


def parametrised_formulas(terms: Mapping[Term, float]) -> tuple[Formula, ...]:
    """Formulas with a free parameter for each coefficient, ``c1`` ..., and for each shape, ``w1`` ..."""
    shapes = shape_names(list(terms))
    formulas = []
    for target, cables in _sites(terms):
        parts, numbers = [], {}
        for index, (term, coefficient) in enumerate(terms.items(), start=1):
            if (term.target, term.cables) != (target, cables):
                continue
            numbers[f"c{index}"] = coefficient
            text = term.text
            if term.family:
                name = shapes[term.family, term.shape]
                numbers[name] = term.shape
                text = text.replace(SHAPE_PARAMETER, name)
            parts.append(f"c{index}*{text}")
        formulas.append(Formula(target, " + ".join(parts), cables, numbers))
    return tuple(formulas)


def _sites(terms: Iterable[Term]) -> list[Site]:
    """Sites of terms, in the order of a robot file."""
    return sorted(
        dict.fromkeys(term.site for term in terms),
        key=lambda site: (list(VARIABLES_BY_TARGET).index(site.target), site),
    )


def shape_names(terms: Sequence[Term]) -> dict[tuple[str, float], str]:
    """The name of each shape that terms share, by family and value."""
    shapes = dict.fromkeys((term.family, term.shape) for term in terms if term.family)
    return {shape: f"w{index}" for index, shape in enumerate(shapes, start=1)}


def numeric_formulas(terms: Mapping[Term, float], deviations: Mapping[str, float]) -> tuple[Formula, ...]:
    """Formulas with numbers in the text; ``deviations`` by the names of :func:`parametrised_formulas`."""
    shapes = shape_names(list(terms))
    formulas = []
    for target, cables in _sites(terms):
        text = ""
        for index, (term, coefficient) in enumerate(terms.items(), start=1):
            if (term.target, term.cables) != (target, cables):
                continue
            factor = rounded_to_uncertainty(abs(coefficient), deviations[f"c{index}"])
            sign = "-" if coefficient < 0.0 else "+" if text else ""
            expression = term.text
            if term.family:
                expression = expression.replace(
                    SHAPE_PARAMETER, rounded_to_uncertainty(term.shape, deviations[shapes[term.family, term.shape]])
                )
            product = factor if expression == "1" else f"{factor}*{expression}"
            text += f" {sign} {product}" if text else f"{sign}{product}"
        formulas.append(Formula(target, text, cables))
    return tuple(formulas)


def rounded_to_uncertainty(value: float, deviation: float) -> str:
    """A number rounded to one digit more than the first of its standard deviation."""
    if not (deviation > 0.0 and isfinite(deviation)) or value == 0.0:
        return repr(value)
    digits = floor(log10(abs(value))) - floor(log10(deviation)) + 1 + EXTRA_DIGITS
    return f"{value:.{min(max(digits, 1), 15)}g}"


def formula_text(robot: Robot, formulas: Sequence[Formula]) -> str:
    """Formulas with their targets in a robot, as in ``force_y = -31.2*vx; tension_2 = 4*travel``."""
    return "; ".join(f"{_site_label(robot, formula)} = {formula.text}" for formula in formulas)


def effects_text(settings: Iterable[tuple[str, EffectSetting]]) -> str:
    """Labels of effects with their numbers, as in ``frame: compliance = 3.3e-07``."""
    texts = (
        f"{label}: {', '.join(f'{name} = {value:.4g}' for name, value in setting.values.items())}"
        for label, setting in settings
    )
    return "; ".join(texts)


def _site_label(robot: Robot, formula: Formula) -> str:
    if formula.cables in ((), robot.cable_numbers):
        return formula.target
    return f"{formula.target}_{'_'.join(map(str, formula.cables))}"
