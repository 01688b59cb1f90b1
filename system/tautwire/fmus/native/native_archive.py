"""Archive of a native FMU: the model description of the Python one, machine code, source, and documentation."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from tautwire_fmu import slaves
from tautwire_fmu.slave import Slave

from ... import __version__
from ..fmu_archive import DESCRIPTION_FILE, read_model_description
from ..fmu_documentation import documentation_files
from .c_toolchain import TargetPlatform, Toolchain, compile_library
from .component_sources import ENTRY_FILE, component_sources, rate_references

# Old enough for every archive, and the same in all builds.
ENTRY_DATE = (1980, 1, 1, 0, 0, 0)


def write_native_fmu(
    kind: str, base: str, data: Mapping[str, Any], platforms: Sequence[TargetPlatform], toolchain: Toolchain, path: Path
) -> None:
    """Write the native FMU of a component; ``base`` is the class of its Python slave, ``data`` the slave's resource.

    Raises NativeBuildError where the compiler refuses.
    """
    unidentified = dict(data) | {"guid": "", "version": __version__}
    slave = python_slave(kind, base, unidentified)
    anonymous = component_sources(kind, slave, unidentified, "").files
    guid = str(uuid5(NAMESPACE_URL, json.dumps([anonymous, unidentified], sort_keys=True)))
    slave.guid = guid
    sources = component_sources(kind, slave, unidentified, guid).files
    name = unidentified["model_name"]
    libraries = {
        f"binaries/{platform.name}/{name}{platform.suffix}": compile_library(sources, platform, toolchain)
        for platform in platforms
    }
    description = tostring(native_description(slave), encoding="utf-8", xml_declaration=True)
    contents: dict[str, bytes] = {
        DESCRIPTION_FILE: description,
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        **libraries,
    }
    _write_archive(path, contents)
    additions = documentation_files(kind, unidentified, read_model_description(path))
    _write_archive(path, contents | additions)


def python_slave(kind: str, base: str, data: Mapping[str, Any]) -> Slave:
    """The Python slave of a component's resource: its variables, and the values that they start with."""
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as resources:
        (Path(resources) / f"{kind}.json").write_text(json.dumps(data), encoding="utf-8")
        slave: Slave = getattr(slaves, base)(instance_name=data["model_name"], resources=resources)
    return slave


def native_description(slave: Slave) -> Element:
    """Model description of the Python slave, with what its native twin can do and its sources."""
    root = slave.to_xml()
    cosimulation = root.find("CoSimulation")
    assert cosimulation is not None
    options = {
        "needsExecutionTool": "false",
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": str(_output_derivative_order(slave)),
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
    }
    for name, value in options.items():
        cosimulation.set(name, value)
    source_files = SubElement(cosimulation, "SourceFiles")
    SubElement(source_files, "File", {"name": ENTRY_FILE})
    if "generationDateAndTime" in root.attrib:
        del root.attrib["generationDateAndTime"]
    indent(root, "\t")
    return root


def _output_derivative_order(slave: Slave) -> int:
    """Highest order of derivatives that some output has as further variables."""
    rates, count = rate_references(slave.variables), len(slave.variables)
    order = 0
    references = [index for index, variable in enumerate(slave.variables) if variable.causality == "output"]
    while references:
        references = [rates[reference] for reference in references if rates[reference] < count]
        order += bool(references)
    return order


def _write_archive(path: Path, contents: Mapping[str, bytes]) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(zipfile.ZipInfo(name, ENTRY_DATE), content, zipfile.ZIP_DEFLATED)
