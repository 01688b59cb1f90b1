"""Model exchange beside co-simulation: the variables that it adds to a component, and its part of the description."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from tautwire_fmu.model_description import Variable
from tautwire_fmu.slave import Slave
from tautwire_fmu.units import UNITS

RATE_UNITS = {"1": "1/s", "s": "1", "m": "m/s", "m/s": "m/s2", "m/s2": "m/s3", "N m s": "N m"}
MIDDLE_PREFIX = "middle_"
# Of an output the parameter of its lag, and the rate that the curve to now goes through where a step is longer than it.
LATE_OUTPUTS = {
    "tension": ("effect.sensor_delay.tension_delay", "tension_rate"),
    **{f"measured_position.{axis}": ("effect.sensor_delay.position_delay", f"acceleration.{axis}") for axis in "xyz"},
}


def further_variables(slave: Slave, indicator_count: int) -> tuple[Variable, ...]:
    """Derivatives of the states, then event indicators: they have the value references behind those of the slave."""
    states = slave.variables[slave.states]
    rates = (
        Variable(f"der({each.name})", "local", RATE_UNITS[each.unit], f"rate of {each.name}", rate_of=each.name)
        for each in states
    )
    text = "event indicator: at a change of sign some rate or output has a kink"
    indicators = (Variable(f"event_indicator_{k}", "local", "1", text) for k in range(1, indicator_count + 1))
    return (*rates, *indicators)


def add_model_exchange(root: Element, slave: Slave, further: Sequence[Variable], source_file: str) -> None:
    """Complete the description of a co-simulation FMU by FMI 2.0 with model exchange and its ``further`` variables."""
    cosimulation = root.find("CoSimulation")
    assert cosimulation is not None
    options = {
        "modelIdentifier": cosimulation.attrib["modelIdentifier"],
        "needsExecutionTool": "false",
        "completedIntegratorStepNotNeeded": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    interface = Element("ModelExchange", options)
    SubElement(SubElement(interface, "SourceFiles"), "File", {"name": source_file})
    root.insert(list(root).index(cosimulation), interface)
    state_count = slave.states.stop - slave.states.start
    root.set("numberOfEventIndicators", str(len(further) - state_count))
    _add_units(root, further)
    _add_variables(root, slave, further)
    _complete_structure(root, slave, state_count)


def _add_units(root: Element, further: Sequence[Variable]) -> None:
    definitions = root.find("UnitDefinitions")
    assert definitions is not None
    defined = {unit.attrib["name"] for unit in definitions}
    of_which = {rate: unit for unit, rate in RATE_UNITS.items()}
    for name in sorted({variable.unit for variable in further} - defined):
        exponents = UNITS[name] if name in UNITS else _rate_exponents(of_which[name])
        bases = {base: str(exponent) for base, exponent in exponents.items()}
        SubElement(SubElement(definitions, "Unit", {"name": name}), "BaseUnit", bases)


def _rate_exponents(unit: str) -> dict[str, int]:
    return {**UNITS[unit], "s": UNITS[unit].get("s", 0) - 1}


def _add_variables(root: Element, slave: Slave, further: Sequence[Variable]) -> None:
    parent = root.find("ModelVariables")
    assert parent is not None
    places = {variable.name: place for place, variable in enumerate(slave.variables, start=1)}
    for reference, variable in enumerate(further, start=len(slave.variables)):
        attributes = {"name": variable.name, "valueReference": str(reference), "description": variable.description}
        attributes |= {"causality": "local", "variability": "continuous", "initial": "calculated"}
        real = SubElement(SubElement(parent, "ScalarVariable", attributes), "Real", {"unit": variable.unit})
        if variable.rate_of is not None:
            real.set("derivative", str(places[variable.rate_of]))


def _complete_structure(root: Element, slave: Slave, state_count: int) -> None:
    """Outputs depend on states too; derivatives may depend on all that is known, and have to be known at the start."""
    structure, outputs, unknowns = (root.find(f"ModelStructure{part}") for part in ("", "/Outputs", "/InitialUnknowns"))
    assert structure is not None and outputs is not None and unknowns is not None
    states = range(slave.states.start + 1, slave.states.stop + 1)
    inputs_of = {int(each.attrib["index"]): set(map(int, each.attrib["dependencies"].split())) for each in outputs}
    for output in outputs:
        place = int(output.attrib["index"])
        inputs = inputs_of[place] | inputs_of.get(_rate_shown_late(slave, place), set())
        known = [place] if place in states else sorted({*inputs, *states})
        if not slave.variables[place - 1].name.startswith(MIDDLE_PREFIX):
            output.set("dependencies", " ".join(map(str, known)))
    rates = range(len(slave.variables) + 1, len(slave.variables) + 1 + state_count)
    derivatives = Element("Derivatives")
    for place in rates:
        SubElement(derivatives, "Unknown", {"index": str(place)})
    structure.insert(list(structure).index(outputs) + 1, derivatives)
    first = {int(unknown.attrib["index"]) for unknown in unknowns}
    unknowns[:] = [Element("Unknown", {"index": str(place)}) for place in sorted({*first, *states, *rates})]


def _rate_shown_late(slave: Slave, place: int) -> int:
    """Place of the rate on which an output depends too where its sensor lags; 0 where there is none."""
    places = {variable.name: each for each, variable in enumerate(slave.variables, start=1)}
    lag, rate = LATE_OUTPUTS.get(slave.variables[place - 1].name, ("", ""))
    return places.get(rate, 0) if lag in places else 0
