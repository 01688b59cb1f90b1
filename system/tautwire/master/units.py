"""Whether two variables of FMUs bear the same unit, whatever each tool calls it."""

from __future__ import annotations

from collections.abc import Mapping

from fmpy.model_description import ModelDescription, ScalarVariable

BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
Measure = tuple[float, ...]


def unit_of(variable: ScalarVariable) -> str | None:
    """The unit that a variable or its type states; None where neither does."""
    stated = variable.unit or getattr(variable.declaredType, "unit", None)
    return str(stated) if stated else None


def nominal_of(variable: ScalarVariable) -> float:
    """The size that a variable or its type states; one where neither does, or where it is zero, which FMI forbids."""
    stated = variable.nominal or getattr(variable.declaredType, "nominal", None)
    return abs(float(stated or 1.0)) or 1.0


def measure(description: ModelDescription, unit: str) -> Measure | None:
    """Exponents of the SI base units, then factor and offset; None where the FMU does not define the unit."""
    for known in description.unitDefinitions:
        if known.name == unit and known.baseUnit is not None:
            base = known.baseUnit
            exponents = (float(getattr(base, name) or 0.0) for name in BASES)
            return (*exponents, float(1.0 if base.factor is None else base.factor), float(base.offset or 0.0))
    return None


def measure_of(exponents: Mapping[str, int]) -> Measure:
    """What :func:`measure` gives for a product of powers of base units."""
    return (*(float(exponents.get(name, 0)) for name in BASES), 1.0, 0.0)


def same_unit(a: tuple[str | None, Measure | None], b: tuple[str | None, Measure | None]) -> bool:
    """Whether two units, each a name and what it measures, are the same; one that is not stated fits any."""
    (name, size), (other_name, other_size) = a, b
    if name is None or other_name is None:
        return True
    return name == other_name if size is None or other_size is None else size == other_size
