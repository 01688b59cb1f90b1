"""Units and nominal values of FMU variables, compared across tools."""

from __future__ import annotations

from collections.abc import Mapping

from fmpy.model_description import ModelDescription, ScalarVariable

SI_BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
UnitDefinition = tuple[float, ...]


def unit_of(variable: ScalarVariable) -> str | None:
    """The unit that a variable or its type states; None where neither does."""
    unit = variable.unit or getattr(variable.declaredType, "unit", None)
    return str(unit) if unit else None


def nominal_of(variable: ScalarVariable) -> float:
    """The nominal value that a variable or its type states; one where neither does, or where zero, against FMI."""
    nominal = variable.nominal or getattr(variable.declaredType, "nominal", None)
    return abs(float(nominal or 1.0)) or 1.0


def unit_definition(description: ModelDescription, unit: str) -> UnitDefinition | None:
    """Exponents of the SI base units, then factor and offset; None where the FMU does not define the unit."""
    for definition in description.unitDefinitions:
        if definition.name == unit and definition.baseUnit is not None:
            base_unit = definition.baseUnit
            exponents = (float(getattr(base_unit, name) or 0.0) for name in SI_BASE_UNITS)
            return (
                *exponents,
                float(1.0 if base_unit.factor is None else base_unit.factor),
                float(base_unit.offset or 0.0),
            )
    return None


def definition_from_exponents(exponents: Mapping[str, int]) -> UnitDefinition:
    """The definition, as of :func:`unit_definition`, of a product of powers of base units."""
    return (*(float(exponents.get(name, 0)) for name in SI_BASE_UNITS), 1.0, 0.0)


def same_unit(a: tuple[str | None, UnitDefinition | None], b: tuple[str | None, UnitDefinition | None]) -> bool:
    """Whether two units, each a name and its definition, are the same; one that is not stated fits any."""
    (name, definition), (other_name, other_definition) = a, b
    if name is None or other_name is None:
        return True
    return name == other_name if definition is None or other_definition is None else definition == other_definition
