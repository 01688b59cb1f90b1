"""Archive of a native FMU: the model description of the Python one, machine code, source, and documentation."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from tautwire_fmu.model_description import Variable
from tautwire_fmu.slave import Slave

from ... import __version__
from ...errors import ArgumentError
from ..fmu_archive import DESCRIPTION_FILE, read_model_description
from ..fmu_documentation import documentation_files
from .c_toolchain import PLATFORMS, TargetPlatform, Toolchain, compile_library, find_toolchain, target_platforms
from .component_sources import ENTRY_FILE, component_sources, rate_references
from .fmi3_description import build_description, fmi3_description
from .model_exchange import add_model_exchange
from .python_slaves import python_slave
from .robot_slave import whole_robot_slave
from .universal_binary import ARM_64, X86_64, universal_binary

FMI_VERSIONS = (2, 3)
# CasADi's generated code is free of its license, by its own word.
LICENSED_PACKAGES = ("tautwire",)
# Old enough for every archive, and the same in all builds.
ENTRY_DATE = (1980, 1, 1, 0, 0, 0)
ENTRY_MODE = 0o100644


@dataclass(frozen=True)
class NativeTarget:
    """What native FMUs are built for: platforms, the compiler, the major version of FMI, and its interfaces.

    Co-simulation is always one; ``model_exchange`` is the other, of components that can do it.
    """

    platforms: tuple[TargetPlatform, ...]
    toolchain: Toolchain
    fmi: int = 2
    model_exchange: bool = True

    def library(self, platform: TargetPlatform, name: str) -> str:
        """Path of a library in the archive."""
        folder = platform.name if self.fmi == 2 else platform.tuple_name
        return f"binaries/{folder}/{name}{platform.suffix}"


def native_target(platforms: Sequence[str] = (), fmi: int = 2, model_exchange: bool = True) -> NativeTarget:
    """Target by the names of platforms, see :func:`tautwire.fmus.native.c_toolchain.target_platforms`."""
    if fmi not in FMI_VERSIONS:
        raise ArgumentError("build_fmus: fmi", fmi, f"is {fmi!r}", f"give one of {FMI_VERSIONS}")
    toolchain = find_toolchain()
    return NativeTarget(target_platforms(platforms, toolchain), toolchain, fmi, model_exchange)


def write_native_fmu(kind: str, base: str, data: Mapping[str, Any], target: NativeTarget, path: Path) -> None:
    """Write the native FMU of a component; ``base`` is the class of its Python slave, ``data`` the slave's resource.

    Raises NativeBuildError where the compiler refuses.
    """
    unidentified = dict(data) | {"guid": "", "version": __version__}
    slave = whole_robot_slave(unidentified) if kind == "robot" else python_slave(kind, base, unidentified)
    interfaces = (target.fmi, target.model_exchange)
    anonymous = component_sources(kind, slave, unidentified, "", *interfaces).files
    slave.guid = str(uuid5(NAMESPACE_URL, json.dumps([anonymous, unidentified], sort_keys=True)))
    component = component_sources(kind, slave, unidentified, slave.guid, *interfaces)
    sources = component.files
    name = unidentified["model_name"]
    compile_for = partial(_compiled, sources, target)
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        compiled = list(threads.map(compile_for, target.platforms))
    libraries = dict(zip((target.library(platform, name) for platform in target.platforms), compiled, strict=True))
    contents = {
        DESCRIPTION_FILE: _xml(native_description(slave, target.fmi, component.further_variables)),
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        **libraries,
    }
    if target.fmi == 3:
        contents["sources/buildDescription.xml"] = _xml(build_description(name, ENTRY_FILE))
    _write_archive(path, contents)
    additions = documentation_files(kind, unidentified, read_model_description(path), LICENSED_PACKAGES)
    _write_archive(path, contents | additions)


def _compiled(sources: Mapping[str, str], target: NativeTarget, platform: TargetPlatform) -> bytes:
    library = compile_library(sources, platform, target.toolchain)
    if target.fmi != 2 or platform.name != "darwin64":
        return library
    for_arm = compile_library(sources, PLATFORMS["aarch64-darwin"], target.toolchain)
    return universal_binary({X86_64: library, ARM_64: for_arm})


def _xml(root: Element) -> bytes:
    indent(root, "\t")
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text


def native_description(slave: Slave, fmi: int, further: Sequence[Variable] = ()) -> Element:
    """Model description of the Python slave, with what its native twin can do and its sources.

    ``further`` are the variables that model exchange adds, none where there is none.
    """
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
        "providesDirectionalDerivative": "true",
    }
    for name, value in options.items():
        cosimulation.set(name, value)
    source_files = SubElement(cosimulation, "SourceFiles")
    SubElement(source_files, "File", {"name": ENTRY_FILE})
    if further:
        add_model_exchange(root, slave, further, ENTRY_FILE)
    if "generationDateAndTime" in root.attrib:
        del root.attrib["generationDateAndTime"]
    return root if fmi == 2 else fmi3_description(root)


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
            entry = zipfile.ZipInfo(name, ENTRY_DATE)
            entry.external_attr = ENTRY_MODE << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
