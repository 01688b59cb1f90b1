"""Completes modelDescription.xml: units, bounds, exact start values, dependencies, initial unknowns."""

import math
from typing import Dict, NamedTuple, Optional, Sequence, Tuple
from xml.etree.ElementTree import Element, SubElement

from .units import UNITS


class Variable(NamedTuple):
    """One real FMI variable of a slave.

    ``depends_on`` names the inputs that act on an output without delay, ``rate_of`` the variable before it whose rate
    this is; a ``discrete`` one holds over a step.
    """

    name: str
    causality: str
    unit: str
    description: str
    start: float = 0.0
    tunable: bool = False
    minimum: Optional[float] = None
    maximum: Optional[float] = None
    nominal: Optional[float] = None
    depends_on: Tuple[str, ...] = ()
    discrete: bool = False
    rate_of: Optional[str] = None


def bound_problem(variable: Variable, value: float) -> str:
    """What is wrong with a value of a variable: not finite, or outside the declared bounds; empty where nothing is."""
    lowest = -math.inf if variable.minimum is None else variable.minimum
    highest = math.inf if variable.maximum is None else variable.maximum
    if math.isfinite(value) and lowest <= value <= highest:
        return ""
    bounds = " and ".join(
        f"{words} {bound!r}"
        for words, bound in (("at least", variable.minimum), ("at most", variable.maximum))
        if bound is not None
    )
    unit = "" if variable.unit == "1" else f" {variable.unit}"
    return f"{variable.name} is {value!r}{unit}, it has to be {f'{bounds}{unit}' if bounds else 'finite'}"


def vector_variables(vector: Variable, start: Tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Tuple[Variable, ...]:
    """Three variables ``name.x``, ``name.y``, ``name.z`` of a vector, which is given as if it were one variable."""
    return tuple(
        vector._replace(
            name=f"{vector.name}.{axis}",
            description=f"{vector.description}, {axis} axis",
            start=value,
            rate_of=None if vector.rate_of is None else f"{vector.rate_of}.{axis}",
        )
        for axis, value in zip("xyz", start)
    )


def axis_names(*names: str) -> Tuple[str, ...]:
    """Names of the components of vectors."""
    return tuple(f"{name}.{axis}" for name in names for axis in "xyz")


def complete_model_description(root: Element, variables: Sequence[Variable]) -> Element:
    """Complete pythonfmu's model description with the FMI 2.0 attributes that pythonfmu leaves out.

    Raises KeyError where a variable has a unit that :data:`UNITS` does not list.
    """
    by_name = {variable.name: variable for variable in variables}
    index = {}
    nodes = root.find("ModelVariables")
    assert nodes is not None
    for position, node in enumerate(nodes, start=1):
        name = node.attrib["name"]
        index[name] = position
        if name in by_name:
            _complete_real(node[0], by_name[name], index)
    root.insert(1, _unit_definitions(variables))
    _complete_structure(root, variables, index)
    return root


def _complete_real(real: Element, variable: Variable, index: Dict[str, int]) -> None:
    real.set("unit", variable.unit)
    for key, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal)):
        if value is not None:
            real.set(key, repr(float(value)))
    if "start" in real.attrib:
        real.set("start", repr(float(variable.start)))
    if variable.rate_of is not None:
        real.set("derivative", str(index[variable.rate_of]))


def _unit_definitions(variables: Sequence[Variable]) -> Element:
    definitions = Element("UnitDefinitions")
    for unit in sorted({variable.unit for variable in variables}):
        node = SubElement(definitions, "Unit", {"name": unit})
        SubElement(node, "BaseUnit", {base: str(exponent) for base, exponent in UNITS[unit].items()})
    return definitions


def _complete_structure(root: Element, variables: Sequence[Variable], index: Dict[str, int]) -> None:
    structure = root.find("ModelStructure")
    assert structure is not None
    for child in list(structure):
        structure.remove(child)
    outputs = SubElement(structure, "Outputs")
    unknowns = SubElement(structure, "InitialUnknowns")
    for variable in variables:
        if variable.causality != "output":
            continue
        dependencies = sorted(index[name] for name in variable.depends_on)
        attributes = {"index": str(index[variable.name]), "dependencies": " ".join(map(str, dependencies))}
        SubElement(outputs, "Unknown", attributes)
        SubElement(unknowns, "Unknown", {"index": attributes["index"]})
