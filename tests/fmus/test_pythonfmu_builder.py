"""FMUs get a library whatever FMUs the process has loaded."""

import os
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from tautwire.fmus.packaging import RobotFmus
from tests.support.folders import ROOT

BUILD = """
from pathlib import Path
from tautwire.fmus.packaging import build_fmus
from tautwire.fmus.component import Component
from tests.support.robots import paper_robot
built = build_fmus(paper_robot(), Path({folder!r}))
with Component("built", built.platform) as component:
    component.initialize(0.0, {{}})
"""


@pytest.fixture(scope="module")
def unpacked(three_fmus: RobotFmus, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What an importer leaves of an FMU: its folder with modules, and no binaries among them."""
    folder = tmp_path_factory.mktemp("unpacked")
    fmpy.extract(str(three_fmus.platform), str(folder))
    return folder / "resources"


def run(*arguments: str) -> None:
    path = os.pathsep.join([str(ROOT), *sys.path])
    subprocess.run([sys.executable, *arguments], check=True, env={**os.environ, "PYTHONPATH": path}, timeout=120)


def test_after_an_fmu_was_loaded(three_fmus: RobotFmus, tmp_path: Path) -> None:
    loaded = f"""
import fmpy
fmpy.simulate_fmu({str(three_fmus.platform)!r}, stop_time=0.01)
"""
    run("-c", loaded + BUILD.format(folder=str(tmp_path)))


@pytest.mark.validate
def test_beside_an_fmu_whose_folder_is_first_on_the_path(unpacked: Path, tmp_path: Path) -> None:
    run("-c", f"import sys; sys.path.insert(0, {str(unpacked)!r})\n" + BUILD.format(folder=str(tmp_path)))


@pytest.mark.validate
def test_where_an_fmus_copy_of_the_builder_was_imported(unpacked: Path, tmp_path: Path) -> None:
    copy = f"import sys; sys.path.insert(0, {str(unpacked)!r})\nimport pythonfmu.builder\n"
    copy += "assert not pythonfmu.builder.FmuBuilder.has_binary()\n"
    run("-c", copy + BUILD.format(folder=str(tmp_path)))


@pytest.mark.validate
def test_a_process_spawned_beside_a_loaded_fmu_builds_too(unpacked: Path, tmp_path: Path) -> None:
    script = tmp_path / "spawns.py"
    script.write_text(
        f"""
import sys
from multiprocessing import get_context
from pathlib import Path

def build(folder):
    from tautwire.fmus.packaging import build_fmus
    from tests.support.robots import paper_robot
    return str(build_fmus(paper_robot(), Path(folder)).platform)

if __name__ == "__main__":
    sys.path.insert(0, {str(unpacked)!r})
    with get_context("spawn").Pool(1) as pool:
        path = pool.apply(build, ({str(tmp_path)!r},))
    from tautwire.fmus.component import Component
    with Component("built", Path(path)) as component:
        component.initialize(0.0, {{}})
""",
        encoding="utf-8",
    )
    run(str(script))


@pytest.mark.validate
def test_what_travels_inside_is_imported_once_for_all_fmus_and_leaves_no_trace(tmp_path: Path) -> None:
    code = f"""
import sys
from tautwire.fmus.packaging import build_fmus
from tests.support.robots import paper_robot

class Observer:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("tautwire_fmu_") and name.endswith(".slaves"):
            imported.append(name)

imported, search_path = [], list(sys.path)
sys.meta_path.insert(0, Observer())
assert len(build_fmus(paper_robot(), {str(tmp_path)!r}).paths) == 4
assert len(imported) == 1, imported
assert (imported[0] in sys.modules, sys.path) == (False, search_path)
"""
    run("-c", code)


def test_a_library_without_binaries_is_an_error(tmp_path: Path) -> None:
    code = f"""
import shutil, sys
from pathlib import Path
import pythonfmu
bare = Path({str(tmp_path)!r}) / "site" / "pythonfmu"
shutil.copytree(Path(pythonfmu.__file__).parent, bare, ignore=shutil.ignore_patterns("binaries"))
for name in [name for name in sys.modules if name.startswith("pythonfmu")]:
    del sys.modules[name]
sys.path.insert(0, str(bare.parent))
from tautwire.fmus.pythonfmu_builder import FmuLibraryError, installed_builder
try:
    with installed_builder(Path({str(tmp_path)!r}), ["none"]):
        pass
except FmuLibraryError as error:
    assert error.folder == bare and "install it again" in str(error)
else:
    raise SystemExit("not told")
"""
    run("-c", code)
