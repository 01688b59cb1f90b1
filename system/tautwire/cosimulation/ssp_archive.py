"""Writes a robot's FMUs, their connections, parameter values, units and layout as one SSP 1.0 archive.

``SystemStructure.ssd`` has system connectors for the external inputs of the winches and for the recorded outputs.
Importers that know connections between components only (libcosim, ecos) refuse those, so ``ComponentsOnly.ssd``, a
second variant in the same archive, omits them.
"""

from __future__ import annotations

import re
import unicodedata
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmpy.model_description import ModelDescription, ScalarVariable

from tautwire_fmu.units import UNITS

from .. import __version__
from ..atomic_output import atomic_file
from ..errors import one_line
from ..fmus.fmi_binding import is_real_scalar
from ..fmus.fmu_archive import read_model_description
from ..fmus.fmu_slots import SlotPort, slot_ports
from ..fmus.packaging import RobotFmus
from ..fmus.variable_units import SI_BASE_UNITS, definition_from_exponents, unit_definition, unit_of
from ..robot.schema import Robot
from . import Connection, Port
from .robot_cosimulation import wire_fmus
from .robot_wiring import PLATFORM, midpoint_connections
from .ssp_layout import Rectangle, component_rectangle, connector_positions, system_rectangle

SYSTEM_STRUCTURE = "SystemStructure.ssd"
COMPONENTS_ONLY = "ComponentsOnly.ssd"
SYSTEM_NAME = "robot"
NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = {
    "xmlns:ssd": f"{NAMESPACE}Description",
    "xmlns:ssc": f"{NAMESPACE}Common",
    "xmlns:ssv": f"{NAMESPACE}ParameterValues",
}
# s: as in the FMUs.
DEFAULT_STOP_TIME = 10.0
MAX_STEM_BYTES = 100
RESERVED_NAMES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
# Reproducible archives: the same FMUs give the same bytes, without the time of writing.
ENTRY_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class _SspComponent:
    """An SSP component: its name and FMU, the FMU's variables by name, its connectors and their units.

    ``start_values`` take the place of the FMU's own.
    """

    name: str
    path: Path
    description: ModelDescription
    variables: Mapping[str, ScalarVariable]
    connectors: Mapping[str, str]
    start_values: Mapping[str, float]

    def unit_attributes(self, unit: str) -> dict[str, str]:
        """The attributes of a unit's BaseUnit element, as the FMU defines it."""
        if unit in UNITS:
            return {base: str(exponent) for base, exponent in UNITS[unit].items()}
        *exponents, factor, offset = unit_definition(self.description, unit) or definition_from_exponents({})
        powers = {base: str(int(power)) for base, power in zip(SI_BASE_UNITS, exponents, strict=True) if power}
        return powers | ({} if (factor, offset) == (1.0, 0.0) else {"factor": repr(factor), "offset": repr(offset)})


def ssp_name(robot: Robot) -> str:
    """A file name for a robot's archive that any file system takes, whatever the robot is called."""
    text = re.sub(r"[^\w.-]+", "_", unicodedata.normalize("NFC", robot.name))
    stem = text.encode("utf-8", "ignore")[:MAX_STEM_BYTES].decode("utf-8", "ignore").strip("._-")
    return f"{SYSTEM_NAME}_{stem}.ssp" if RESERVED_NAMES.match(stem) else f"{stem or SYSTEM_NAME}.ssp"


def write_ssp(robot: Robot, fmus: RobotFmus, path: Path) -> Path:
    """Write the archive to ``path``; it appears there only when it is complete.

    Raises InputError where ``path`` cannot be written.
    """
    wiring = wire_fmus(fmus)
    # Importers do not set midpoint inputs.
    midpoint_wires = midpoint_connections(len(fmus.cables), fmus.is_rigid)
    wires = [wire for wire in wiring.connections if wire not in midpoint_wires]
    system_inputs = {_system_connector_name(port): port for port in wiring.external_inputs}
    system_outputs = {_system_connector_name(port): port for port in wiring.outputs}
    ends = [end for wire in wires for end in (wire.source, wire.target)]
    components = _ssp_components(fmus, [*ends, *system_inputs.values(), *system_outputs.values()])
    with atomic_file(path) as scratch, zipfile.ZipFile(scratch, "w") as archive:
        _add_entry(
            archive, SYSTEM_STRUCTURE, _system_description(robot, components, wires, system_inputs, system_outputs)
        )
        _add_entry(archive, COMPONENTS_ONLY, _system_description(robot, components, wires, {}, {}))
        for component in components.values():
            _add_entry(archive, _fmu_path(component), component.path.read_bytes(), zipfile.ZIP_STORED)
    return path


def _ssp_components(fmus: RobotFmus, ports: Iterable[Port]) -> dict[str, _SspComponent]:
    names: dict[str, dict[str, None]] = {name: {} for name in fmus.by_component}
    for port in ports:
        names[port.component][port.variable] = None
    return {
        name: _ssp_component(name, fmus, names[name], slot_ports(name, len(fmus.cables), fmus.is_rigid))
        for name in fmus.by_component
    }


def _ssp_component(name: str, fmus: RobotFmus, connectors: Iterable[str], ports: Iterable[SlotPort]) -> _SspComponent:
    path = fmus.by_component[name]
    description = read_model_description(path)
    variables = {variable.name: variable for variable in description.modelVariables}
    default_units = {port.name: port.unit for port in ports}
    units = {connector: unit_of(variables[connector]) or default_units[connector] for connector in connectors}
    return _SspComponent(name, path, description, variables, units, fmus.start_values_of(name))


def _system_connector_name(port: Port) -> str:
    """The name of a system connector: ``tension_2`` for the tension of the second cable."""
    return port.variable if port.component == PLATFORM else f"{port.variable}_{port.component.rpartition('_')[2]}"


def _fmu_path(component: _SspComponent) -> str:
    return f"resources/{component.name}.fmu"


def _add_entry(archive: zipfile.ZipFile, name: str, data: bytes, method: int = zipfile.ZIP_DEFLATED) -> None:
    entry = zipfile.ZipInfo(name, ENTRY_DATE)
    entry.compress_type = method
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, data)


def _system_description(
    robot: Robot,
    components: Mapping[str, _SspComponent],
    wires: Iterable[Connection],
    system_inputs: Mapping[str, Port],
    system_outputs: Mapping[str, Port],
) -> bytes:
    name = one_line(robot.name)
    root = Element("ssd:SystemStructureDescription", {**NAMESPACES, "version": "1.0", "name": name})
    root.set("generationTool", f"Tautwire {__version__}")
    system = SubElement(root, "ssd:System", {"name": SYSTEM_NAME, "description": f"cable robot {name}"})
    if system_inputs or system_outputs:
        connectors = SubElement(system, "ssd:Connectors")
        kinds = ["input"] * len(system_inputs) + ["output"] * len(system_outputs)
        ports = [*system_inputs.items(), *system_outputs.items()]
        for kind, position, (connector_name, port) in zip(kinds, connector_positions(kinds), ports, strict=True):
            _add_connector(connectors, connector_name, kind, position, port.variable, components[port.component])
    elements = SubElement(system, "ssd:Elements")
    for component in components.values():
        _add_component(elements, component, robot.cable_count)
    _add_connections(system, wires, system_inputs, system_outputs)
    _add_rectangle(system, "ssd:SystemGeometry", system_rectangle(robot.cable_count))
    _add_units(root, components.values())
    SubElement(root, "ssd:DefaultExperiment", {"startTime": "0.0", "stopTime": str(DEFAULT_STOP_TIME)})
    indent(root)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _add_component(elements: Element, component: _SspComponent, cable_count: int) -> None:
    attributes = {"name": component.name, "type": "application/x-fmu-sharedlibrary", "source": _fmu_path(component)}
    element = SubElement(elements, "ssd:Component", attributes | {"implementation": "CoSimulation"})
    connectors = SubElement(element, "ssd:Connectors")
    kinds = [component.variables[connector].causality for connector in component.connectors]
    positions = connector_positions(kinds)
    for connector, kind, position in zip(component.connectors, kinds, positions, strict=True):
        _add_connector(connectors, connector, kind, position, connector, component)
    _add_rectangle(element, "ssd:ElementGeometry", component_rectangle(component.name, cable_count))
    bindings = SubElement(element, "ssd:ParameterBindings")
    values = SubElement(SubElement(bindings, "ssd:ParameterBinding"), "ssd:ParameterValues")
    settings = SubElement(values, "ssv:ParameterSet", {"version": "1.0", "name": "values"})
    numbers = SubElement(settings, "ssv:Parameters")
    parameters = [v for v in component.variables.values() if v.causality == "parameter" and is_real_scalar(v)]
    for parameter in parameters:
        number = SubElement(numbers, "ssv:Parameter", {"name": parameter.name})
        unit = unit_of(parameter)
        SubElement(
            number,
            "ssv:Real",
            {"value": str(component.start_values.get(parameter.name, parameter.start))}
            | ({"unit": unit} if unit else {}),
        )
    _add_unit_list(
        settings,
        "ssv:Units",
        {unit: component.unit_attributes(unit) for unit in filter(None, map(unit_of, parameters))},
    )


def _add_connector(
    parent: Element, name: str, kind: str, position: tuple[float, float], variable: str, component: _SspComponent
) -> None:
    connector = SubElement(parent, "ssd:Connector", {"name": name, "kind": kind})
    if component.variables[variable].description:
        connector.set("description", component.variables[variable].description)
    SubElement(connector, "ssc:Real", {"unit": component.connectors[variable]})
    x, y = position
    SubElement(connector, "ssd:ConnectorGeometry", {"x": repr(x), "y": repr(y)})


def _add_rectangle(parent: Element, tag: str, rectangle: Rectangle) -> None:
    SubElement(parent, tag, {name: repr(value) for name, value in rectangle._asdict().items()})


def _add_connections(
    system: Element, wires: Iterable[Connection], system_inputs: Mapping[str, Port], system_outputs: Mapping[str, Port]
) -> None:
    connections = SubElement(system, "ssd:Connections")
    for wire in wires:
        SubElement(
            connections, "ssd:Connection", _connection_end("start", wire.source) | _connection_end("end", wire.target)
        )
    for name, port in system_inputs.items():
        SubElement(connections, "ssd:Connection", {"startConnector": name} | _connection_end("end", port))
    for name, port in system_outputs.items():
        SubElement(connections, "ssd:Connection", _connection_end("start", port) | {"endConnector": name})


def _connection_end(side: str, port: Port) -> dict[str, str]:
    return {f"{side}Element": port.component, f"{side}Connector": port.variable}


def _add_units(root: Element, components: Iterable[_SspComponent]) -> None:
    """The units of all connectors; parameter sets list their own."""
    _add_unit_list(
        root,
        "ssd:Units",
        {unit: component.unit_attributes(unit) for component in components for unit in component.connectors.values()},
    )


def _add_unit_list(parent: Element, tag: str, units: Mapping[str, Mapping[str, str]]) -> None:
    unit_list = SubElement(parent, tag)
    for unit, bases in sorted(units.items()):
        node = SubElement(unit_list, "ssc:Unit", {"name": unit})
        SubElement(node, "ssc:BaseUnit", dict(bases))
