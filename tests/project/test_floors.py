"""The lowest versions that are declared, for ``make floors``; and the version that the documents state."""

import re
from importlib.metadata import version

from packaging.requirements import Requirement
from packaging.version import Version

import tautwire
from tests.floors import floors
from tests.support.folders import ROOT


def test_every_dependency_has_a_lowest_version_that_is_installed() -> None:
    lines = [Requirement(line) for line in floors()]
    assert {"numpy", "casadi", "typer", "asammdf", "h5py", "rosbags"} <= {line.name for line in lines}
    for line in lines:
        (lowest,) = line.specifier
        assert lowest.operator == "=="
        if line.name not in ("asammdf", "h5py", "rosbags", "tomli"):
            assert Version(version(line.name)) >= Version(lowest.version), line.name


def test_the_documents_state_this_version() -> None:
    stated = tautwire.__version__
    assert re.search(
        rf"^version: {re.escape(stated)}$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert f"## [{stated}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
