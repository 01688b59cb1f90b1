"""Chosen terms as formulas: open, with names for their numbers, and closed, with as many digits as are known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import floor, isfinite, log10

from tautwire_fmu.laws.formula import PLACES

from ...robots.robot import EffectSetting, Formula, Robot
from .library import SHAPE, Term
from .ports import Site

# Digits of a number beyond the first of its standard deviation.
FURTHER = 1


def opened(terms: Mapping[Term, float]) -> tuple[Formula, ...]:
    """Formulas with a free number for each coefficient, ``c1`` ..., and for each shape, ``w1`` ..."""
    shapes = shape_names(list(terms))
    formulas = []
    for place, cables in _sites(terms):
        parts, numbers = [], {}
        for index, (term, coefficient) in enumerate(terms.items(), start=1):
            if (term.place, term.cables) != (place, cables):
                continue
            numbers[f"c{index}"] = coefficient
            text = term.text
            if term.family:
                name = shapes[term.family, term.shape]
                numbers[name] = term.shape
                text = text.replace(SHAPE, name)
            parts.append(f"c{index}*{text}")
        formulas.append(Formula(place, " + ".join(parts), cables, numbers))
    return tuple(formulas)


def _sites(terms: Iterable[Term]) -> list[Site]:
    """Where terms act, in the order of a robot file."""
    return sorted(dict.fromkeys(term.site for term in terms), key=lambda site: (list(PLACES).index(site.place), site))


def shape_names(terms: Sequence[Term]) -> dict[tuple[str, float], str]:
    """The name of each shape that terms share, by family and value."""
    shapes = dict.fromkeys((term.family, term.shape) for term in terms if term.family)
    return {shape: f"w{index}" for index, shape in enumerate(shapes, start=1)}


def closed(terms: Mapping[Term, float], deviations: Mapping[str, float]) -> tuple[Formula, ...]:
    """Formulas with their numbers in the text; ``deviations`` by the names of :func:`opened`."""
    shapes = shape_names(list(terms))
    formulas = []
    for place, cables in _sites(terms):
        text = ""
        for index, (term, coefficient) in enumerate(terms.items(), start=1):
            if (term.place, term.cables) != (place, cables):
                continue
            factor = known_digits(abs(coefficient), deviations[f"c{index}"])
            sign = "-" if coefficient < 0.0 else "+" if text else ""
            inner = term.text
            if term.family:
                inner = inner.replace(SHAPE, known_digits(term.shape, deviations[shapes[term.family, term.shape]]))
            said = factor if inner == "1" else f"{factor}*{inner}"
            text += f" {sign} {said}" if text else f"{sign}{said}"
        formulas.append(Formula(place, text, cables))
    return tuple(formulas)


def known_digits(value: float, deviation: float) -> str:
    """A number to one digit more than the first of its standard deviation."""
    if not (deviation > 0.0 and isfinite(deviation)) or value == 0.0:
        return repr(value)
    digits = floor(log10(abs(value))) - floor(log10(deviation)) + 1 + FURTHER
    return f"{value:.{min(max(digits, 1), 15)}g}"


def formula_text(robot: Robot, formulas: Sequence[Formula]) -> str:
    """Formulas with their places in a robot, as in ``force_y = -31.2*vx; tension_2 = 4*travel``."""
    return "; ".join(f"{_place(robot, formula)} = {formula.text}" for formula in formulas)


def effects_text(settings: Iterable[tuple[str, EffectSetting]]) -> str:
    """Labels of effects with their numbers, as in ``frame: compliance = 3.3e-07``."""
    texts = (
        f"{label}: {', '.join(f'{name} = {value:.4g}' for name, value in setting.values.items())}"
        for label, setting in settings
    )
    return "; ".join(texts)


def _place(robot: Robot, formula: Formula) -> str:
    if formula.cables in ((), robot.cable_numbers):
        return formula.place
    return f"{formula.place}_{'_'.join(map(str, formula.cables))}"
