"""Writes a robot's FMUs, their wiring, parameter values and units as one SSP 1.0 archive.

``SystemStructure.ssd`` has connectors of its own for what drives the winches (in) and for what a run shows (out).
Importers that know connections between components only (libcosim, ecos) refuse those, so ``ComponentsOnly.ssd``, a
second variant in the same archive, leaves them away.
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

from ..errors import one_line
from ..fmus.packaging import RobotFmus
from ..fmus.slots import slot_ports
from ..master import Connection, Port
from ..master.archive import description_of
from ..master.standard import is_real
from ..master.units import BASES, measure, measure_of, unit_of
from ..output import file_in_place
from ..robots.robot import Robot
from .cosimulation import wired
from .wiring import PLATFORM, middle_connections

OPEN = "SystemStructure.ssd"
COMPONENTS_ONLY = "ComponentsOnly.ssd"
SYSTEM = "robot"
NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"
SPACES = {
    "xmlns:ssd": f"{NAMESPACE}Description",
    "xmlns:ssc": f"{NAMESPACE}Common",
    "xmlns:ssv": f"{NAMESPACE}ParameterValues",
}
LONGEST_STEM = 100
RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
# The same FMUs give the same bytes: no time of writing goes into the archive.
STAMP = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class _Part:
    """A component of the system: its name and FMU, the FMU's variables by name, its connectors and their units."""

    name: str
    path: Path
    description: ModelDescription
    variables: Mapping[str, ScalarVariable]
    connectors: Mapping[str, str]

    def bases(self, unit: str) -> dict[str, str]:
        """The attributes that tell what a unit measures, as the FMU defines it."""
        if unit in UNITS:
            return {base: str(exponent) for base, exponent in UNITS[unit].items()}
        *exponents, factor, offset = measure(self.description, unit) or measure_of({})
        powers = {base: str(int(power)) for base, power in zip(BASES, exponents, strict=True) if power}
        return powers | ({} if (factor, offset) == (1.0, 0.0) else {"factor": repr(factor), "offset": repr(offset)})


def ssp_name(robot: Robot) -> str:
    """A file name for a robot's archive that any file system takes, whatever the robot is called."""
    text = re.sub(r"[^\w.-]+", "_", unicodedata.normalize("NFC", robot.name))
    stem = text.encode("utf-8", "ignore")[:LONGEST_STEM].decode("utf-8", "ignore").strip("._-")
    return f"{SYSTEM}_{stem}.ssp" if RESERVED.match(stem) else f"{stem or SYSTEM}.ssp"


def write_ssp(robot: Robot, fmus: RobotFmus, path: Path) -> Path:
    """Write the archive to ``path``; it appears there only when it is complete.

    Raises InputError where ``path`` cannot be written.
    """
    wiring = wired(fmus)
    # Importers know no middle of a step.
    middle = middle_connections(len(fmus.cables))
    wires = [wire for wire in wiring.connections if wire not in middle]
    inward = {_outer_name(port): port for port in wiring.drives}
    outward = {_outer_name(port): port for port in wiring.shown}
    ends = [end for wire in wires for end in (wire.source, wire.target)]
    parts = _parts(fmus, [*ends, *inward.values(), *outward.values()])
    with file_in_place(path) as scratch, zipfile.ZipFile(scratch, "w") as archive:
        _add(archive, OPEN, _description(robot, parts, wires, inward, outward))
        _add(archive, COMPONENTS_ONLY, _description(robot, parts, wires, {}, {}))
        for part in parts.values():
            _add(archive, _source(part), part.path.read_bytes(), zipfile.ZIP_STORED)
    return path


def _parts(fmus: RobotFmus, ports: Iterable[Port]) -> dict[str, _Part]:
    names: dict[str, dict[str, None]] = {name: {} for name in fmus.parts}
    for port in ports:
        names[port.component][port.variable] = None
    return {name: _part(name, path, names[name], len(fmus.cables)) for name, path in fmus.parts.items()}


def _part(name: str, path: Path, connectors: Iterable[str], cable_count: int) -> _Part:
    description = description_of(path)
    variables = {variable.name: variable for variable in description.modelVariables}
    ours = {port.name: port.unit for port in slot_ports(name, cable_count)}
    units = {connector: unit_of(variables[connector]) or ours[connector] for connector in connectors}
    return _Part(name, path, description, variables, units)


def _outer_name(port: Port) -> str:
    """The name of a system connector: ``tension_2`` for the tension of the second cable."""
    return port.variable if port.component == PLATFORM else f"{port.variable}_{port.component.rpartition('_')[2]}"


def _source(part: _Part) -> str:
    return f"resources/{part.name}.fmu"


def _add(archive: zipfile.ZipFile, name: str, data: bytes, method: int = zipfile.ZIP_DEFLATED) -> None:
    entry = zipfile.ZipInfo(name, STAMP)
    entry.compress_type = method
    entry.external_attr = 0o644 << 16
    archive.writestr(entry, data)


def _description(
    robot: Robot,
    parts: Mapping[str, _Part],
    wires: Iterable[Connection],
    inward: Mapping[str, Port],
    outward: Mapping[str, Port],
) -> bytes:
    name = one_line(robot.name)
    root = Element("ssd:SystemStructureDescription", {**SPACES, "version": "1.0", "name": name})
    root.set("generationTool", "Tautwire")
    system = SubElement(root, "ssd:System", {"name": SYSTEM, "description": f"cable robot {name}"})
    if inward or outward:
        frame = SubElement(system, "ssd:Connectors")
        for kind, ports in (("input", inward), ("output", outward)):
            for outer, port in ports.items():
                _connector(frame, outer, kind, port.variable, parts[port.component])
    elements = SubElement(system, "ssd:Elements")
    for component, part in parts.items():
        _component(elements, component, part)
    _connections(system, wires, inward, outward)
    _units(root, parts.values())
    indent(root)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _component(elements: Element, name: str, part: _Part) -> None:
    attributes = {"name": name, "type": "application/x-fmu-sharedlibrary", "source": _source(part)}
    component = SubElement(elements, "ssd:Component", attributes | {"implementation": "CoSimulation"})
    frame = SubElement(component, "ssd:Connectors")
    for connector in part.connectors:
        _connector(frame, connector, part.variables[connector].causality, connector, part)
    bindings = SubElement(component, "ssd:ParameterBindings")
    values = SubElement(SubElement(bindings, "ssd:ParameterBinding"), "ssd:ParameterValues")
    settings = SubElement(values, "ssv:ParameterSet", {"version": "1.0", "name": "values"})
    numbers = SubElement(settings, "ssv:Parameters")
    parameters = [v for v in part.variables.values() if v.causality == "parameter" and is_real(v)]
    for parameter in parameters:
        number = SubElement(numbers, "ssv:Parameter", {"name": parameter.name})
        unit = unit_of(parameter)
        SubElement(number, "ssv:Real", {"value": str(parameter.start)} | ({"unit": unit} if unit else {}))
    _unit_list(settings, "ssv:Units", {unit: part.bases(unit) for unit in filter(None, map(unit_of, parameters))})


def _connector(frame: Element, name: str, kind: str, variable: str, part: _Part) -> None:
    connector = SubElement(frame, "ssd:Connector", {"name": name, "kind": kind})
    if part.variables[variable].description:
        connector.set("description", part.variables[variable].description)
    SubElement(connector, "ssc:Real", {"unit": part.connectors[variable]})


def _connections(
    system: Element, wires: Iterable[Connection], inward: Mapping[str, Port], outward: Mapping[str, Port]
) -> None:
    frame = SubElement(system, "ssd:Connections")
    for wire in wires:
        SubElement(frame, "ssd:Connection", _end("start", wire.source) | _end("end", wire.target))
    for outer, port in inward.items():
        SubElement(frame, "ssd:Connection", {"startConnector": outer} | _end("end", port))
    for outer, port in outward.items():
        SubElement(frame, "ssd:Connection", _end("start", port) | {"endConnector": outer})


def _end(side: str, port: Port) -> dict[str, str]:
    return {f"{side}Element": port.component, f"{side}Connector": port.variable}


def _units(root: Element, parts: Iterable[_Part]) -> None:
    """The units of all connectors; parameter sets list their own."""
    _unit_list(root, "ssd:Units", {unit: part.bases(unit) for part in parts for unit in part.connectors.values()})


def _unit_list(parent: Element, tag: str, units: Mapping[str, Mapping[str, str]]) -> None:
    frame = SubElement(parent, tag)
    for unit, bases in sorted(units.items()):
        node = SubElement(frame, "ssc:Unit", {"name": unit})
        SubElement(node, "ssc:BaseUnit", dict(bases))
