"""FMUs end with the process that loaded them."""

import subprocess
import sys
import zipfile
from importlib.resources import files
from pathlib import Path

import pytest

from tautwire.fmus.packaging import RobotFmus
from tautwire.fmus.pythonfmu_builder import RETURN_INSTRUCTION, patch_wrapper_exit, with_immediate_return

LIBRARY = files("pythonfmu") / "resources/binaries/linux64/libpythonfmu-export.so"
MANY = """
import sys
from pathlib import Path
from tautwire.cosimulation import Component
made = [Component(f"cable {k}", Path(sys.argv[1])) for k in range(4)]
for component in made:
    component.initialize(0.0, {})
"""


def test_one_byte_differs_from_pythonfmus_wrapper() -> None:
    original = LIBRARY.read_bytes()
    mended = with_immediate_return(original)
    places = [k for k, (a, b) in enumerate(zip(original, mended, strict=True)) if a != b]
    assert len(places) == 1
    assert mended[places[0] : places[0] + 1] == RETURN_INSTRUCTION
    assert with_immediate_return(mended) == mended


@pytest.mark.parametrize("content", [b"", b"MZ not an ELF file"])
def test_other_libraries_stay_as_they_are(content: bytes) -> None:
    assert with_immediate_return(content) == content


def test_built_fmus_have_the_corrected_wrapper(three_fmus: RobotFmus) -> None:
    with zipfile.ZipFile(three_fmus.platform) as packed:
        library = packed.read("binaries/linux64/platform.so")
    assert with_immediate_return(library) == library


def test_all_else_in_an_fmu_stays(three_fmus: RobotFmus, tmp_path: Path) -> None:
    patch_wrapper_exit(three_fmus.platform, tmp_path / "again.fmu")
    with zipfile.ZipFile(three_fmus.platform) as before, zipfile.ZipFile(tmp_path / "again.fmu") as after:
        assert before.namelist() == after.namelist()
        assert all(before.read(name) == after.read(name) for name in before.namelist())


@pytest.mark.validate
def test_a_process_with_instances_never_freed_ends_well(three_fmus: RobotFmus) -> None:
    done = subprocess.run([sys.executable, "-c", MANY, str(three_fmus.cables[0])], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()[-500:]
