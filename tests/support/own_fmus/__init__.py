"""FMUs that are not the project's, as other tools make them."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Mapping
from pathlib import Path

import fmpy

from tests.support.pythonfmu_command import build_by_command

HERE = Path(__file__).parent
GUID = "{4a1d6f0e-0c55-4f8e-9b1c-2f6f0c9a7c11}"
LAG = 0.05  # s, of the winch


def falling_mass(folder: Path) -> Path:
    """The paper's platform."""
    return build_by_command(HERE / "falling_mass.py", folder / "FallingMass.fmu")


def spring_cable(folder: Path) -> Path:
    """Cable 2 of the paper's robot with the linear law."""
    return build_by_command(HERE / "spring_cable.py", folder / "SpringCable.fmu")


def compiler() -> str | None:
    """A C compiler, where there is one."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def lag_winch(folder: Path) -> Path:
    """The winch of ``lag_winch.c``."""
    return packed(folder / "lag_winch.fmu", _compiled(folder, "lag_winch.c"))


def lag_winch_3(folder: Path, fault: str = "SOUND") -> Path:
    """The winch of ``lag_winch_3.c``, by FMI 3.0; ``fault`` is a way in which its step goes wrong."""
    return packed_3(folder / f"lag_winch_{fault}.fmu", _compiled(folder, "lag_winch_3.c", f"-DFAULT={fault}"))


def _compiled(folder: Path, source: str, *options: str) -> bytes:
    result = compiler()
    assert result is not None
    library = folder / "lag_winch.so"
    headers = Path(fmpy.__file__).parent / "c-code"
    given = [str(HERE / source), f"-I{headers}", "-lm", *options]
    subprocess.run([result, "-shared", "-fPIC", "-O2", "-o", str(library), *given], check=True, timeout=120)
    return library.read_bytes()


def packed(path: Path, library: bytes, description: Mapping[str, str] | None = None, platform: str = "") -> Path:
    """An FMU of a library and the winch's description; ``description`` replaces texts in it."""
    return _packed(path, library, DESCRIPTION, description or {}, platform or fmpy.platform)


def packed_3(path: Path, library: bytes, description: Mapping[str, str] | None = None) -> Path:
    """The same by FMI 3.0."""
    return _packed(path, library, DESCRIPTION_3, description or {}, fmpy.platform_tuple)


def _packed(path: Path, library: bytes, text: str, changes: Mapping[str, str], platform: str) -> Path:
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.writestr(f"binaries/{platform}/lag_winch.so", library)
    return path


DESCRIPTION = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="lag_winch" guid="{GUID}" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="lag_winch" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"/>
  <UnitDefinitions>
    <Unit name="m.s-1"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="speed_command" valueReference="0" causality="input" variability="continuous">
      <Real unit="m.s-1" start="0"/>
    </ScalarVariable>
    <ScalarVariable name="winch_speed" valueReference="1" causality="output" variability="continuous" initial="exact">
      <Real unit="m.s-1" start="0"/>
    </ScalarVariable>
    <ScalarVariable name="lag" valueReference="2" causality="parameter" variability="fixed" initial="exact">
      <Real unit="s" start="{LAG}"/>
    </ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/></Outputs>
  </ModelStructure>
</fmiModelDescription>
"""

DESCRIPTION_3 = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="lag_winch" instantiationToken="{GUID}">
  <CoSimulation modelIdentifier="lag_winch" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"/>
  <UnitDefinitions>
    <Unit name="m.s-1"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Speed" unit="m.s-1"/>
  </TypeDefinitions>
  <ModelVariables>
    <Float64 name="time" valueReference="9" causality="independent" variability="continuous"/>
    <Float64 name="speed_command" valueReference="0" causality="input" declaredType="Speed" start="0"/>
    <Float64 name="winch_speed" valueReference="1" causality="output" initial="exact" declaredType="Speed" start="0"/>
    <Float64 name="lag" valueReference="2" causality="parameter" variability="fixed" unit="s" start="{LAG}"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1" dependencies=""/>
  </ModelStructure>
</fmiModelDescription>
"""
