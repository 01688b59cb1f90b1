"""Library of candidate terms, and the formulas written from selected ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from math import floor, isfinite, log10

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.expression import evaluate, parse_expression
from tautwire_fmu.laws.formula import FORCE_TARGETS, VARIABLES_BY_TARGET

from ...robot.robot_assembly import NUMPY_MATHEMATICS
from ...robot.schema import EffectSetting, Formula, Robot
from .formula_ports import PortSignals, Site

Array = NDArray[np.float64]

# Scales of tanh in root mean squares of its argument; wavelengths in a room and on a drum, in shares of the motion.
TANH_SCALES = (0.1, 0.3, 1.0)
WAVELENGTH_COUNT = 14
MAX_WAVELENGTH_RATIO, MIN_WAVELENGTH_RATIO = 3.0, 0.1
SHAPE_PARAMETER = "shape"
# The last term keeps its slope finite at rest.
SPEED_EXPRESSION = "sqrt(vx**2 + vy**2 + vz**2 + 1e-12)"


@dataclass(frozen=True)
class Term:
    """Candidate term of a formula: ``text`` may use a ``shape``, a parameter fitted with the coefficient.

    Terms of one ``family`` and shape share the parameter. ``cables`` as in a formula. ``resembles_effect`` marks a term
    that looks like a known effect, and accompanies others.
    """

    target: str
    text: str
    cables: tuple[int, ...] = ()
    family: str = ""
    shape: float = 0.0
    resembles_effect: bool = False

    @property
    def site(self) -> Site:
        """The site where the term acts."""
        return Site(self.target, self.cables)

    def series(self, names: dict[str, Array]) -> Array:
        """Values of the term along a run, (K,)."""
        tree = parse_expression(self.text, (*VARIABLES_BY_TARGET[self.target], SHAPE_PARAMETER))
        example = next(iter(names.values()))
        values: Array = evaluate(NUMPY_MATHEMATICS, tree, {**names, SHAPE_PARAMETER: self.shape}) * np.ones_like(
            example
        )
        return values


@dataclass(frozen=True)
class SignalRanges:
    """Ranges of a run's signals: mean and root mean square of each name, on the platform and over all ropes.

    ``peak_to_peak`` is largest less smallest value by name.
    """

    platform: dict[str, tuple[float, float]]
    rope: dict[str, tuple[float, float]]
    peak_to_peak: dict[str, float] = field(default_factory=dict)


def signal_ranges(runs: Sequence[PortSignals]) -> SignalRanges:
    """Signal ranges of a run, given segment by segment."""
    platform = {name: np.concatenate([run.platform[name] for run in runs]) for name in runs[0].platform}
    rope = {name: np.concatenate([r[name] for run in runs for r in run.ropes]) for name in runs[0].ropes[0]}
    peak_to_peak = {name: float(np.ptp(values)) for name, values in (platform | rope).items()}
    return SignalRanges(_means_and_rms(platform), _means_and_rms(rope), peak_to_peak)


def _means_and_rms(columns: dict[str, Array]) -> dict[str, tuple[float, float]]:
    return {name: (float(np.mean(v)), float(np.sqrt(np.mean(v**2)))) for name, v in columns.items()}


def candidate_terms(robot: Robot, ranges: SignalRanges, frequencies: Sequence[float]) -> tuple[Term, ...]:
    """All candidate terms; ``frequencies`` are angular ones (rad/s) of lines in the residual's spectrum."""
    terms = [
        *_mass_terms(),
        *(term for force in FORCE_TARGETS for term in _force_terms(force, robot, ranges, frequencies)),
    ]
    all_cables = robot.cable_numbers
    for cables in (all_cables, *((cable,) for cable in all_cables)):
        terms += _tension_terms(cables, ranges, frequencies)
    return tuple(terms)


def _mass_terms() -> Iterator[Term]:
    for text in ("time", "time**2"):
        yield Term("mass", text)


def _force_terms(force: str, robot: Robot, ranges: SignalRanges, frequencies: Sequence[float]) -> Iterator[Term]:
    centred = [_centred(axis, value) for axis, value in zip("xyz", robot.platform.start, strict=True)]
    moving = [*centred, "vx", "vy", "vz"]
    yield Term(force, "1", resembles_effect=True)
    for text in _monomials(moving, 3):
        yield Term(force, text)
    for velocity in ("vx", "vy", "vz"):
        yield Term(force, f"{velocity}*{SPEED_EXPRESSION}", resembles_effect=True)
        yield from _saturating_terms(force, velocity, (), ranges.platform[velocity][1])
    for text in ("time", "time**2", *(f"time*{name}" for name in moving)):
        yield Term(force, text)
    yield from _periodic_terms(force, (), frequencies)
    for axis, start in zip("xyz", centred, strict=True):
        for length in _wavelengths(ranges.peak_to_peak[axis]):
            yield from _harmonic_terms(force, start, (), axis, 2.0 * np.pi / length)


def _tension_terms(cables: tuple[int, ...], ranges: SignalRanges, frequencies: Sequence[float]) -> Iterator[Term]:
    """Candidate tensions: growth with time resembles creep or heat, waves over the travel an eccentric drum."""
    names = ("tension", "strain_rate", "winch_speed", "travel", "time")
    for text in (*_monomials(names, 2), *(f"{name}**3" for name in names)):
        yield Term("tension", text, cables, resembles_effect=text in names or "time" in text)
    for name in ("strain_rate", "winch_speed"):
        yield Term("tension", f"abs({name})", cables)
        yield Term("tension", f"{name}*abs({name})", cables)
        yield from _saturating_terms("tension", name, cables, ranges.rope[name][1], resembles_effect=True)
    yield from _periodic_terms("tension", cables, frequencies)
    for length in _wavelengths(ranges.peak_to_peak["travel"]):
        yield from _harmonic_terms("tension", "travel", cables, "travel", 2.0 * np.pi / length, resembles_effect=True)


def _centred(axis: str, start: float) -> str:
    return f"({axis} {'-' if start >= 0.0 else '+'} {abs(start):.4g})" if round(start, 3) else axis


def _monomials(names: Sequence[str], degree: int) -> Iterator[str]:
    for order in range(1, degree + 1):
        for selected in combinations_with_replacement(names, order):
            powers = {name: selected.count(name) for name in selected}
            yield "*".join(name if power == 1 else f"{name}**{power}" for name, power in powers.items())


def _saturating_terms(
    target: str, name: str, cables: tuple[int, ...], rms: float, resembles_effect: bool = False
) -> Iterator[Term]:
    for scale in TANH_SCALES:
        if rms > 0.0:
            yield Term(
                target, f"tanh({SHAPE_PARAMETER}*{name})", cables, f"{name} bent", 1.0 / (scale * rms), resembles_effect
            )


def _periodic_terms(target: str, cables: tuple[int, ...], frequencies: Sequence[float]) -> Iterator[Term]:
    for frequency in frequencies:
        yield from _harmonic_terms(target, "time", cables, "time", frequency)


def _harmonic_terms(
    target: str,
    name: str,
    cables: tuple[int, ...],
    family: str,
    angular_frequency: float,
    resembles_effect: bool = False,
) -> Iterator[Term]:
    for function in ("sin", "cos"):
        yield Term(target, f"{function}({SHAPE_PARAMETER}*{name})", cables, family, angular_frequency, resembles_effect)


def _wavelengths(peak_to_peak: float) -> list[float]:
    """Wavelengths in m that a motion of this extent could show."""
    if peak_to_peak <= 0.0:
        return []
    lengths: list[float] = np.geomspace(
        MAX_WAVELENGTH_RATIO * peak_to_peak, MIN_WAVELENGTH_RATIO * peak_to_peak, WAVELENGTH_COUNT
    ).tolist()
    return lengths


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
    """Labels of effects with their numbers, as in ``frame: compliance = 3.3e-07 m/N``."""
    return "; ".join(f"{label}: {', '.join(_values_with_units(setting))}" for label, setting in settings)


def _values_with_units(setting: EffectSetting) -> Iterator[str]:
    units = {parameter.name: parameter.unit for parameter in BY_NAME[setting.name].parameters}
    return (f"{name} = {value:.4g} {units[name]}".removesuffix(" 1") for name, value in setting.values.items())


def _site_label(robot: Robot, formula: Formula) -> str:
    if formula.cables in ((), robot.cable_numbers):
        return formula.target
    return f"{formula.target}_{'_'.join(map(str, formula.cables))}"
